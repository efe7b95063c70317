"""Logs added to a store: found in folders, in the order of their names, followed on threads or on a cluster.

What a store has is not followed again, so work that was stopped goes on where it stopped. Each record is on the disk
before the next one is written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from ramsight.errors import DescriptionError, RamsightError, one_line
from ramsight.histories.from_log import Following, file_digest, summary
from ramsight.histories.history_store import HistoryStore
from ramsight.histories.record import Record
from ramsight.log_formats import FORMATS
from ramsight.optional import needs
from ramsight.system import processors

SUFFIXES = tuple(suffix for one in FORMATS for suffix in one.suffixes)
"""Of files that are taken for logs in a folder."""
_AHEAD = 3  # logs for each thread of a cluster: one that is followed, the others on their way


@dataclass(frozen=True)
class Added:
    """What became of logs."""

    records: tuple[Record, ...]  # of logs that were new
    known: tuple[Path, ...]  # files whose log has a record already
    refused: tuple[tuple[Path, str], ...]  # files that cannot be read, and why

    @property
    def text(self) -> str:
        """How many there are of each, in a line."""
        alien = sum(bool(one.mistake) for one in self.records)
        more = f" ({alien} of them cannot be this machine's)" if alien else ""
        return f"{len(self.records)} added{more}, {len(self.known)} known, {len(self.refused)} refused"


def logs_in(paths: Iterable[Path]) -> list[Path]:
    """The files among some paths, and those with a suffix of logs in the folders among them, by name.

    Raises:
        DescriptionError: one is not there, or there is no log at all.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += sorted(one for one in path.rglob("*") if one.is_file() and one.name.lower().endswith(SUFFIXES))
        elif path.is_file():
            found.append(path)
        else:
            raise DescriptionError("there is no such file or folder", key="log", value=str(path))
    if not found:
        raise DescriptionError("no log is there", key="log", allowed=f"files that end in {', '.join(SUFFIXES)}")
    return list(dict.fromkeys(found))


def add_logs(
    store: HistoryStore,
    place: int,
    following: Following,
    files: Sequence[Path],
    *,
    at: float | None = None,
    client: Any = None,
    threads: int | None = None,
    advance: Callable[[float], object] = lambda files: None,
    say: Callable[[str], object] = lambda text: None,
) -> Added:
    """Follow the logs that the store does not have, and keep their records.

    Args:
        at: when the log begins, of a single one [s since 1970].
    """
    records, known, refused = [], [], []

    def fresh() -> Iterator[tuple[Path, str]]:
        for path in files:
            try:
                digest = file_digest(path)
            except RamsightError as error:
                refused.append((path, str(error)))
                advance(1.0)
                continue
            if store.has_file(place, digest):
                known.append(path)
                advance(1.0)
            else:
                yield path, digest

    for path, outcome in _followed(following, fresh(), at, client, threads or processors()):
        if isinstance(outcome, str):
            refused.append((path, outcome))
        elif store.add(place, outcome):
            records.append(outcome)
            say(summary(outcome))
        else:
            known.append(path)
        advance(1.0)
    return Added(tuple(records), tuple(known), tuple(refused))


def _followed(
    following: Following, logs: Iterator[tuple[Path, str]], at: float | None, client: Any, threads: int
) -> Iterator[tuple[Path, Record | str]]:
    """Each log's record, or why there is none, as they are done."""
    if client is not None:
        yield from _on_cluster(client, following, logs, at)
        return
    with ThreadPoolExecutor(threads) as pool:
        while batch := list(islice(logs, _AHEAD * threads)):
            running = {pool.submit(outcome_of, following, path, at, digest): path for path, digest in batch}
            for done in as_completed(running):
                yield running[done], done.result()


def outcome_of(following: Following, path: Path, at: float | None, digest: str) -> Record | str:
    """The record of a log, or why there is none."""
    try:
        return following.record(path, at, digest)
    except RamsightError as error:
        return str(error)
    except OSError as error:
        return one_line(f"{path}: {error.strerror or error}")


def _on_cluster(
    client: Any, following: Following, logs: Iterator[tuple[Path, str]], at: float | None
) -> Iterator[tuple[Path, Record | str]]:
    """The same on Dask: workers read the files, so they have to reach them under the same names."""
    completed = needs("distributed", "cluster").as_completed
    order = (following.unit, following.channel_map)
    paths: dict[str, Path] = {}

    def submit(path: Path, digest: str) -> Any:
        future = client.submit(_task, order, path.absolute(), at, digest, pure=False)
        paths[future.key] = path
        return future

    threads = max(sum(client.nthreads().values()), 1)
    running = completed([submit(*one) for one in islice(logs, _AHEAD * threads)], loop=client.loop)
    for future in running:
        yield paths.pop(future.key), future.result()
        for one in islice(logs, 1):
            running.add(submit(*one))


def _task(order: tuple[Any, Any], path: Path, at: float | None, digest: str) -> Record | str:
    """What a worker of a cluster does."""
    return outcome_of(Following(*order), path, at, digest)
