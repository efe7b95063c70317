"""The tour of docs/how-to/studio.md: the studio in Chromium, recorded as a moving picture.

python evaluation/studio_tour.py docs/images/studio-tour.gif
"""

import io
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image

SIZE = {"width": 1500, "height": 1000}
SHOWN = (960, 640)
FRAME = 0.4  # s, from one picture to the next
COLOURS = 224


def record(address: str) -> list[Image.Image]:
    """Pictures of a visit: the boom lifts to an obstacle, loses its thermometer, gets another bore, and lowers."""
    from playwright.sync_api import sync_playwright

    pictures: list[Image.Image] = []
    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport=SIZE)
        page.goto(f"{address}?play=none")
        page.get_by_text("runs", exact=True).wait_for(timeout=120_000)

        def watch(count: int) -> None:
            for _ in range(count):
                page.wait_for_timeout(1e3 * FRAME)
                pictures.append(shot(page))

        watch(2)
        page.get_by_role("button", name="lift boom").click()
        watch(9)
        page.get_by_role("switch", name="an obstacle").evaluate("(e) => e.click()")
        watch(7)
        page.get_by_role("switch", name="an obstacle").evaluate("(e) => e.click()")
        page.get_by_role("button", name="stop boom").click()
        page.get_by_role("switch", name="temperature lost").evaluate("(e) => e.click()")
        watch(4)
        page.get_by_role("switch", name="temperature lost").evaluate("(e) => e.click()")
        edit(page, watch)
        page.get_by_role("button", name="lift boom").click()
        watch(6)
        page.get_by_role("button", name="lower boom").click()
        watch(9)
        browser.close()
    return pictures


def edit(page: Any, watch: Callable[[int], None]) -> None:
    """Write another bore, and run that machine live."""
    page.get_by_role("tab", name="Machines").click()
    page.get_by_text("units.boom.cylinder", exact=True).wait_for()
    page.get_by_text("units.boom.cylinder", exact=True).click()
    watch(2)
    bore = page.locator("[id='value-units.boom.cylinder.bore']")
    bore.fill("150 mm")
    bore.press("Tab")
    watch(2)
    before = page.evaluate("studio.units.boom")["time"][-1]
    page.locator("#run-description").click()
    page.wait_for_function(f"(studio.units.boom?.time.at(-1) ?? 1e9) < {before}", timeout=120_000)
    watch(2)


def shot(page: Any) -> Image.Image:
    """The page as it is, smaller."""
    whole = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    return whole.resize(SHOWN, Image.Resampling.LANCZOS)


def save(pictures: list[Image.Image], file: Path) -> None:
    """Write a moving picture whose frames share few colours, so that what stands costs nothing."""
    some = pictures[:: max(len(pictures) // 6, 1)]
    all_of_them = Image.new("RGB", (SHOWN[0], SHOWN[1] * len(some)))
    for k, one in enumerate(some):
        all_of_them.paste(one, (0, k * SHOWN[1]))
    colours = all_of_them.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    first, *others = (one.quantize(palette=colours, dither=Image.Dither.NONE) for one in pictures)
    first.save(file, save_all=True, append_images=others, duration=int(1e3 * FRAME), loop=0, optimize=True)


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
        save(record(f"http://127.0.0.1:{port}/"), file)
    finally:
        server.terminate()
        server.wait(20)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
