"""Writers of a history that are killed at any moment: what was said to be kept is there, once, and whole."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from pathlib import Path
from typing import Any

from harness import READ, WRONG, Rng, Section

ROOT = Path(__file__).parent.parent
KILLS = 300
_RECORDS = 30
_PAUSE = 3e-3  # s after a record was kept, within which the kill comes: in the next one's transaction


def _prepare(_: Path) -> Any:
    """The records, with all that is loaded to keep them."""
    sys.path.insert(0, str(ROOT))
    import sqlalchemy  # noqa: F401

    from tests import history_bench

    return history_bench


def _begin(bench: Any, path: Path, said: int) -> int:
    """A writer in a process of its own; it says which records are kept."""
    process = os.fork()
    if process == 0:
        try:
            os.dup2(said, 1)
            sys.stdout = os.fdopen(1, "w")
            bench.write(path, 0, _RECORDS, 0.0)
        finally:
            os._exit(0)
    return process


def _check(bench: Any, rng: Rng, folder: Path) -> tuple[str, str]:
    from ramsight.histories.history_store import HistoryStore

    path = folder / "fleet.db"
    for left in folder.glob("fleet.db*"):
        left.unlink()
    read, write = os.pipe()
    process = _begin(bench, path, write)
    os.close(write)
    after = int(rng.integers(_RECORDS))
    with os.fdopen(read) as stream:
        said = set()
        while len(said) < after and (line := stream.readline()):
            said.add(int(line))
        time.sleep(_PAUSE * rng.random())
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        said |= {int(line) for line in stream.read().splitlines() if line}
    with HistoryStore(path, makes=True) as store:
        place = store.described(bench.KEY, "digest", "format = 1")
        kept = [one.file for one in store.records(place)]
        if not {f"{number}.csv" for number in said} <= set(kept):
            return WRONG, f"{len(said)} were said to be kept, {len(kept)} are"
        numbers = list(range(_RECORDS))
        random.Random(int(rng.integers(1 << 30))).shuffle(numbers)
        for number in numbers:
            store.add(place, bench.record(number))
        records = store.records(place)
    whole = sorted(int(one.file.removesuffix(".csv")) for one in records) == list(range(_RECORDS))
    whole &= all(one.quantities == bench.record(0).quantities for one in records)
    return (READ if whole else WRONG), f"killed after {len(kept)} records; {len(records)} in the end"


SECTIONS = [Section("history killed", KILLS, _prepare, _check)]
