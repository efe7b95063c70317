"""Cases by the thousand in a process of their own, so that a crash or a hang is one case and not the end."""

from __future__ import annotations

import contextlib
import logging
import math
import multiprocessing
import os
import resource
import tempfile
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

PATIENCE = 20.0
"""Seconds after which a case hangs, if its section says nothing else."""

MEMORY = 4 << 30
"""Bytes of address space that a case may add."""

READ, WARNED, REFUSED, WRONG, CRASHED, HUNG = "read", "warned", "refused", "silently_wrong", "crashed", "hung"
OUTCOMES = (READ, WARNED, REFUSED, WRONG, CRASHED, HUNG)
_EXAMPLES = 5

Rng = np.random.Generator
Check = Callable[[Any, Rng, Path], "tuple[str | Counter[str], str]"]


@dataclass(frozen=True)
class Section:
    """One kind of case."""

    name: str  # in results/fuzz.json
    cases: int  # how many
    prepare: Callable[[Path], Any]  # what all cases share, made in the process that tries them
    # tries one: what was prepared, its random numbers and a folder; says the outcome and what to tell of it. A case
    # that tries many things, one after the other, says how many had which outcome.
    check: Check
    patience: float = PATIENCE  # seconds after which a case hangs
    tells: bool = False  # whether what is told of its last cases is kept: they measure something


@dataclass
class Tally:
    """What came of a section."""

    counts: Counter[str] = field(default_factory=Counter)
    examples: list[str] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    slowest: float = 0.0
    seconds: float = 0.0

    def add(self, case: int, outcome: str | Counter[str], detail: str, seconds: float) -> None:
        """Count a case."""
        found = Counter([outcome]) if isinstance(outcome, str) else outcome
        self.counts += found
        self.slowest = max(self.slowest, seconds)
        self.told = [*self.told[1 - _EXAMPLES :], detail]
        bad = [one for one in (WRONG, CRASHED, HUNG) if found[one]]
        if bad and len(self.examples) < _EXAMPLES:
            self.examples.append(f"case {case}: {bad[0]}: {detail}")

    def as_json(self, *, tells: bool = False) -> dict[str, Any]:
        """For results/fuzz.json."""
        counts = {outcome: self.counts[outcome] for outcome in OUTCOMES}
        timing = {"slowest_s": round(self.slowest, 3), "seconds": round(self.seconds, 1)}
        told = {"told": self.told} if tells else {}
        return {"tried": sum(self.counts.values()), **counts, **timing, "examples": self.examples, **told}


def run(section: Section, seed: int, cases: int, longest: float = math.inf) -> Tally:
    """Try the cases of a section, one after the other, until so much time is over [s]; a seed gives the same cases."""
    tally, done, begun = Tally(), 0, time.monotonic()
    context = multiprocessing.get_context("fork")
    while done < cases and time.monotonic() - begun < longest:
        ours, theirs = context.Pipe(duplex=False)
        worker = context.Process(target=_work, args=(section, seed, done, cases, theirs), daemon=True)
        worker.start()
        theirs.close()
        done = _watch(section, worker, ours, tally, done, cases, begun + longest)
    tally.seconds = time.monotonic() - begun
    return tally


def _watch(section: Section, worker: Any, ours: Any, tally: Tally, done: int, cases: int, until: float) -> int:
    """Count what a worker reports; the number of the next case once it has ended."""
    is_ready = False
    while done < cases:
        try:
            if not ours.poll(section.patience if is_ready else 600.0):
                worker.kill()
                worker.join()
                tally.add(done, HUNG, f"no answer within {section.patience:g} s", section.patience)
                return done + 1
            report = ours.recv()
        except EOFError:
            worker.join()
            if not is_ready:
                raise RuntimeError(f"{section.name}: cannot be prepared, see above") from None
            tally.add(done, CRASHED, f"the process died with {worker.exitcode}", 0.0)
            return done + 1
        if report is None:
            is_ready = True
            continue
        tally.add(*report)
        done += 1
        if time.monotonic() > until:
            worker.kill()
            break
    worker.join()
    return done


def _work(section: Section, seed: int, first: int, cases: int, theirs: Any) -> None:
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder, tempfile.TemporaryFile() as noise:
        prepared = section.prepare(Path(folder))
        grown = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (grown + MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
        logging.getLogger().addHandler(logging.NullHandler())  # as the command line does
        os.dup2(noise.fileno(), 2)
        theirs.send(None)
        for case in range(first, cases):
            rng = np.random.default_rng([seed, zlib.crc32(section.name.encode()), case])
            begun = time.monotonic()
            try:
                outcome, detail = section.check(prepared, rng, Path(folder))
            except BaseException as error:  # whatever it is, it is what we look for
                last = traceback.extract_tb(error.__traceback__)[-1]
                outcome, detail = CRASHED, f"{type(error).__name__}: {str(error)[:200]} ({last.filename}:{last.lineno})"
            if said := _said(noise):
                outcome, detail = CRASHED, f"standard error: {said}"
            theirs.send((case, outcome, detail, time.monotonic() - begun))
    theirs.close()
    os._exit(0)  # nothing that libraries do at the end is a case


def _said(noise: Any) -> str:
    """What was written to standard error since the last case."""
    size = os.fstat(noise.fileno()).st_size
    if not size:
        return ""
    with contextlib.suppress(OSError):
        text = os.pread(noise.fileno(), 300, 0).decode("utf-8", "replace")
        os.ftruncate(noise.fileno(), 0)
        os.lseek(noise.fileno(), 0, os.SEEK_SET)
        return text
    return "?"
