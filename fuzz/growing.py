"""Logs that grow while they are read: what is there is read, a half line at the end is said, nothing is made up."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from harness import READ, REFUSED, WARNED, WRONG, Rng, Section
from logs import Prepared, frames, tables

CASES = 200
_PIECE = 3000  # bytes that a logger writes at a time, at most
_LEAST = 2.0  # s of the log that are there when it is opened


def _check(prepared: Prepared, rng: Rng, folder: Path) -> tuple[str, str]:
    from ramsight.errors import LogWarning, RamsightError
    from ramsight.logs import open_log

    path = folder / f"growing-{prepared.name}"
    content = prepared.contents[0]
    there = int(rng.integers(len(content) // 10, len(content)))
    path.write_bytes(content[:there])
    (its_own,) = rng.spawn(1)  # two threads draw in an order that changes
    writer = threading.Thread(target=_write, args=(path, content[there:], its_own), daemon=True)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", LogWarning)
        try:
            writer.start()
            tracks = prepared.judge.track(_slowly(open_log(path, prepared.channel_map), rng))
        except RamsightError as error:
            return REFUSED, str(error)
        finally:
            writer.join()
    if wrong := prepared.judge.wrong(tracks):
        return WRONG, wrong
    seen = sum(len(one["time"]) for one in tracks)
    if seen * 0.02 < _LEAST:
        return WRONG, f"only {seen} samples are read"
    return (WARNED, str(caught[0].message)) if caught else (READ, "")


def _slowly(pieces: Any, rng: Rng) -> Any:
    for piece in pieces:
        yield piece
        time.sleep(float(rng.choice([0.0, 0.005])))


def _write(path: Path, rest: bytes, rng: Rng) -> None:
    """Append the rest of a log in pieces that end anywhere."""
    with path.open("ab", buffering=0) as file:
        while rest:
            size = int(rng.integers(1, _PIECE))
            file.write(rest[:size])
            rest = rest[size:]
            time.sleep(0.001)


def _section(name: str, prepare: Callable[[Path], Prepared]) -> Section:
    return Section(f"growing {name}", CASES, prepare, _check)


SECTIONS = [
    _section("CSV", tables("log.csv")),
    _section("MCAP", tables("log.mcap")),
    _section("candump", frames("log.log")),
    _section("ASC", frames("log.asc")),
    _section("BLF", frames("log.blf", compression_level=0)),
]
