"""How quickly the studio shows itself, how many frames a second a page gets, and what that costs, in Chromium.

python benchmarks/studio.py --out results/studio.json --minutes 10

Needs a Chromium and the extra dev. Without a graphics card the machine in space is drawn by the processor, which takes
part of what is measured: above all with several visitors, whose browsers are all on this computer.
"""

import argparse
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

FLAGS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync"]  # fmt: skip
_PATIENCE = 180e3  # ms
_MOST = 20  # visitors
_WATCHED = 20.0  # s, over which frames and delays are taken


def serve(port: int, **environment: str) -> subprocess.Popen[str]:
    """A studio that serves at a port."""
    command = [sys.executable, "-m", "ramsight", "studio", "mining-loader", "--no-show", "--port", str(port)]
    command += ["--visitors", str(_MOST)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, text=True, env=os.environ | environment)
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except OSError:
            time.sleep(0.05)
        else:
            return server
    raise RuntimeError("the studio does not serve")


def opened(browser: Any, address: str, *, moves: bool = False) -> Any:
    """A page whose machine runs, and moves all the time if so wanted."""
    page = browser.new_context(viewport={"width": 1500, "height": 1500}).new_page()
    page.goto(f"{address}?play=none{'&duty=lift+and+lower' if moves else ''}", timeout=_PATIENCE)
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


def starts(browser: Any) -> dict[str, float]:
    """From the command until a machine runs in a page [s]: with nothing kept of a first start, and with all of it."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        kept = {"RAMSIGHT_CACHE": f"{folder}/cache", "PYTHONPYCACHEPREFIX": f"{folder}/bytecode"}
        for name in ("cold_s", "warm_s"):
            port, begun = free_port(), time.monotonic()
            server = serve(port, **kept, PYTHONDONTWRITEBYTECODE="")
            try:
                page = opened(browser, f"http://127.0.0.1:{port}/")
                found[name] = time.monotonic() - begun
                page.context.close()
            finally:
                server.terminate()
                server.wait(20)
    return found


def free_port() -> int:
    """A port at which nobody listens."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


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


def several(
    browser: Any, address: str, server: subprocess.Popen[str], there: list[Any], sessions: int
) -> dict[str, float]:
    """So many visitors at once, all machines moving: how fast their time goes beside ours, and the processes left."""
    pages = [*there, *(opened(browser, address) for _ in range(sessions - len(there)))]
    for one in pages:
        one.get_by_role("button", name="lift boom").click()
    pages[0].wait_for_timeout(5000)
    before, begun = [newest(one) for one in pages], time.monotonic()
    pages[0].wait_for_timeout(1e3 * _WATCHED)
    after, passed = [newest(one) for one in pages], time.monotonic() - begun
    gone = [(now - then) / passed for now, then in zip(after, before, strict=True)]
    found = {"number": sessions, "slowest_of_life": min(gone), "fastest_of_life": max(gone)}
    return found | {"alive": len(workers(server)), "load": os.getloadavg()[0]}


def measure(minutes: float, sessions: int, keep: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    """All figures; `keep` gets those that there are before several visitors come, who may be too many."""
    from playwright.sync_api import sync_playwright

    port = free_port()
    address, server = f"http://127.0.0.1:{port}/", serve(port)
    try:
        with sync_playwright() as p:
            browser = p.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            found: dict[str, Any] = starts(browser)
            page = opened(browser, address, moves=True)
            found |= {"first_paint_s": first_paint(page), "laid_out_s": laid_out(page)}
            found["cores"], found["load"] = os.cpu_count(), os.getloadavg()[0]
            page.wait_for_timeout(5000)
            begun = time.monotonic(), newest(page)
            found["first"] = watch(page, begun) | {"page_mib": heap(page), "workers_mib": workers(server)}
            page.wait_for_timeout(max(60e3 * minutes - 2e3 * _WATCHED, 0.0))
            found["last"] = watch(page, begun) | {"page_mib": heap(page), "workers_mib": workers(server)}
            found["minutes"] = minutes
            page.context.close()
            again = opened(browser, address)
            found["again_first_paint_s"], found["again_laid_out_s"] = first_paint(again), laid_out(again)
            keep(found)
            found["sessions"] = several(browser, address, server, [again], sessions)
            browser.close()
    finally:
        server.terminate()
        server.wait(20)
    return found


def table(found: dict[str, Any]) -> list[str]:
    """The figures as docs/how-to/studio.md quotes them."""
    first, last, many = found["first"], found["last"], found["sessions"]
    paints = [f"{found[name]:.1f} s" for name in ("first_paint_s", "again_first_paint_s")]
    pages = [f"{then['page_mib']:.0f} MiB" for then in (first, last)]
    machines = [f"{sum(then['workers_mib']):.0f} MiB" for then in (first, last)]
    shares = f"{many['slowest_of_life']:.2f} to {many['fastest_of_life']:.2f}"
    rows = [
        ("from the command to a machine that runs, nothing kept of a first start", f"{found['cold_s']:.1f} s"),
        ("the same, with what a first start has kept", f"{found['warm_s']:.1f} s"),
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
        (
            f"load of the computer's {found['cores']} cores, with one visitor and with several",
            f"{found['load']:.0f}, {many['load']:.0f}",
        ),
    ]
    return ["| | |", "|---|---|", *(f"| {what} | {figure} |" for what, figure in rows)]


def main() -> None:
    """Measure and write."""
    options = argparse.ArgumentParser()
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--sessions", type=int, default=8, help="at least 3")
    given = options.parse_args()
    if shutil.which("chromium") is None:
        print("no Chromium: the studio is not measured", file=sys.stderr)
        return

    def keep(found: dict[str, Any]) -> None:
        given.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")

    keep(measure(given.minutes, given.sessions, keep))


if __name__ == "__main__":
    main()
