"""The tour of docs/studio.md: the studio in Chromium, recorded as a moving picture.

python evaluation/studio_tour.py docs/images/studio-tour.gif
"""

import io
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from PIL import Image

SIZE = {"width": 1500, "height": 1000}
SHOWN = (960, 640)
FRAME = 0.5  # s, from one picture to the next


def record(address: str) -> list[Image.Image]:
    """Pictures of a visit: the boom lifts, its pump wears, its thermometer is lost and comes back, it lowers."""
    from playwright.sync_api import sync_playwright

    pictures: list[Image.Image] = []
    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        page.get_by_text("runs", exact=True).wait_for(timeout=120_000)

        def watch(count: int) -> None:
            for _ in range(count):
                page.wait_for_timeout(1e3 * FRAME)
                pictures.append(shot(page))

        watch(2)
        page.get_by_role("button", name="lift boom").click()
        watch(10)
        page.get_by_role("button", name="stop boom").click()
        page.get_by_role("button", name="lift bucket").click()
        watch(5)
        page.get_by_role("button", name="stop bucket").click()
        page.get_by_role("switch", name="temperature lost").click()
        watch(4)
        page.get_by_role("switch", name="temperature lost").click()
        page.get_by_role("button", name="lower boom").click()
        watch(12)
        browser.close()
    return pictures


def shot(page: Any) -> Image.Image:
    """The page as it is, smaller and with few colours."""
    whole = Image.open(io.BytesIO(page.screenshot())).convert("RGB").resize(SHOWN, Image.Resampling.LANCZOS)
    return whole.quantize(128, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)


def main(file: Path) -> None:
    """Serve, record, write."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "ramsight", "studio", "mining-loader", "--no-show", "--port", str(port)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), 1.0).close()
                break
            except OSError:
                time.sleep(0.1)
        first, *others = record(f"http://127.0.0.1:{port}/")
        first.save(file, save_all=True, append_images=others, duration=int(1e3 * FRAME), loop=0, optimize=True)
    finally:
        server.terminate()
        server.wait(20)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
