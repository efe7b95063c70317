"""How quickly the studio shows itself, how many frames a second a page gets, and what that costs, in Chromium.

python benchmarks/studio.py --out studio.json --minutes 10

Needs a Chromium and the extra dev. Without a graphics card the machine in space is drawn by the processor, which takes
part of what is measured.
"""

import argparse
import json
import os
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil

FLAGS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync"]  # fmt: skip
_PATIENCE = 180e3  # ms
_WATCHED = 20.0  # s, over which frames and delays are taken


def serve(port: int) -> subprocess.Popen[str]:
    """A studio that serves at a port."""
    command = [sys.executable, "-m", "ramsight", "studio", "mining-loader", "--no-show", "--port", str(port)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, text=True)
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except OSError:
            time.sleep(0.05)
        else:
            return server
    raise RuntimeError("the studio does not serve")


def opened(browser: Any, address: str) -> Any:
    """A page whose machine runs."""
    page = browser.new_context(viewport={"width": 1500, "height": 1500}).new_page()
    page.goto(f"{address}?play=none", timeout=_PATIENCE)
    page.get_by_text("runs", exact=True).wait_for(timeout=_PATIENCE)
    page.wait_for_function("studio.units.boom && studio.units.boom.time.length > 0", timeout=_PATIENCE)
    return page


def first_paint(page: Any) -> float:
    """First contentful paint since the page was asked for [s]."""
    return float(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")) / 1e3


def laid_out(page: Any) -> float:
    """From the page being asked for until its levers and strips are there [s]."""
    return float(page.evaluate("studio.laidOut")) / 1e3


def watch(page: Any, begun: tuple[float, float]) -> dict[str, float]:
    """Frames a second now, and how far the page's time is behind the wall's since `begun` (wall, machine) [s]."""
    count, start = page.evaluate("studio.count()"), time.monotonic()
    page.wait_for_timeout(1e3 * _WATCHED)
    frames = page.evaluate("studio.count()") - count
    passed = time.monotonic()
    behind = (passed - begun[0]) - (newest(page) - begun[1])
    return {"frames_per_s": frames / (passed - start), "behind_s": behind}


def newest(page: Any) -> float:
    """Newest time of the machine that the page has [s]."""
    return float(page.evaluate("studio.units.boom.time.at(-1)"))


def heap(page: Any) -> float:
    """Memory of the page's objects, after a collection [MiB]."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")["usedSize"]
    session.detach()
    return float(used) / 2**20


def workers(server: subprocess.Popen[str]) -> list[float]:
    """Memory of the machines' processes [MiB]."""
    below = psutil.Process(server.pid).children(recursive=True)
    return [p.memory_info().rss / 2**20 for p in below if "spawn_main" in " ".join(p.cmdline())]


def measure(minutes: float, sessions: int) -> dict[str, Any]:
    """All figures."""
    from playwright.sync_api import sync_playwright

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address, server = f"http://127.0.0.1:{port}/", serve(port)
    try:
        with sync_playwright() as p:
            browser = p.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            page = opened(browser, address)
            found: dict[str, Any] = {"first_paint_s": first_paint(page), "laid_out_s": laid_out(page)}
            found["cores"], found["load"] = os.cpu_count(), os.getloadavg()[0]
            page.get_by_role("button", name="lift boom").click()
            page.wait_for_timeout(5000)
            begun = time.monotonic(), newest(page)
            found["first"] = watch(page, begun) | {"page_mib": heap(page), "workers_mib": workers(server)}
            page.wait_for_timeout(max(60e3 * minutes - 2e3 * _WATCHED, 0.0))
            found["last"] = watch(page, begun) | {"page_mib": heap(page), "workers_mib": workers(server)}
            found["minutes"] = minutes
            again = opened(browser, address)
            found["again_first_paint_s"], found["again_laid_out_s"] = first_paint(again), laid_out(again)
            pages = [again, *(opened(browser, address) for _ in range(sessions - 2))]
            for one in pages:
                one.get_by_role("button", name="lift boom").click()
            before = [newest(one) for one in pages]
            page.wait_for_timeout(1e3 * _WATCHED)
            gone = [(newest(one) - then) / _WATCHED for one, then in zip(pages, before, strict=True)]
            found["sessions"] = {"number": sessions, "slowest_of_life": min(gone), "fastest_of_life": max(gone)}
            found["sessions"]["alive"] = len(workers(server))
            browser.close()
    finally:
        server.terminate()
        server.wait(20)
    return found


def table(found: dict[str, Any]) -> list[str]:
    """The figures as docs/how-to/studio-views.md quotes them."""
    first, last, many = found["first"], found["last"], found["sessions"]
    paints = [f"{found[name]:.1f} s" for name in ("first_paint_s", "again_first_paint_s")]
    pages = [f"{then['page_mib']:.0f} MiB" for then in (first, last)]
    machines = [f"{sum(then['workers_mib']):.0f} MiB" for then in (first, last)]
    shares = f"{many['slowest_of_life']:.2f} to {many['fastest_of_life']:.2f}"
    rows = [
        ("first paint, first and second visitor", ", ".join(paints)),
        (
            "levers and strips there, the same",
            ", ".join(f"{found[f'{which}laid_out_s']:.1f} s" for which in ("", "again_")),
        ),
        ("frames a second of five strips", f"{first['frames_per_s']:.0f}"),
        (f"the same after {found['minutes']:g} minutes", f"{last['frames_per_s']:.0f}"),
        ("the page behind its machine by then", f"{max(last['behind_s'], 0.0):.2f} s"),
        ("the page's objects, then and now", ", ".join(pages)),
        ("the machine's process, then and now", ", ".join(machines)),
        (f"{many['number']} visitors at once, all machines moving: time over life", shares),
        ("of their machines' processes still there", f"{many['alive']}"),
    ]
    return ["| | |", "|---|---|", *(f"| {what} | {figure} |" for what, figure in rows)]


def main() -> None:
    """Measure and write."""
    options = argparse.ArgumentParser()
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--sessions", type=int, default=10, help="at least 3")
    given = options.parse_args()
    if shutil.which("chromium") is None:
        print("no Chromium: the studio is not measured", file=sys.stderr)
        return
    given.out.write_text(json.dumps(measure(given.minutes, given.sessions), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
