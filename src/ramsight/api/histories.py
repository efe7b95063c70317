"""Histories of machines: logs added to a store, what was declared, and all of it as a Dataset."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ramsight.api.arguments import path_argument
from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.histories.adding import Added, add_logs, logs_in
from ramsight.histories.assessed import Assessed, History, assessed
from ramsight.histories.from_log import Following
from ramsight.histories.history_page import fleet_page
from ramsight.histories.history_store import KINDS_OF_EVENT, Event, HistoryStore, Kept
from ramsight.histories.record import MachineKey, description_digest, instant
from ramsight.logs.channel_map import AnyMap
from ramsight.machine import load_machine, only_unit
from ramsight.machine.description import Machine
from ramsight.optional import check_extra
from ramsight.output import check_target, write_text
from ramsight.plant.build import build
from ramsight.progress import progress as progress_bar
from ramsight.signals import Dataset
from ramsight.study.commissioning.kept_values import described_as


@by_kind
def history_add(
    store: str | Path,
    machine: str | Path | Machine,
    logs: Any,
    *,
    unit: str | None = None,
    serial: str = "",
    channel_map: AnyMap | None = None,
    at: str | None = None,
    new_description: bool = False,
    client: Any = None,
    threads: int | None = None,
    progress: bool = False,
) -> Added:
    """Follow a machine's logs, each by a new sensor, and keep a record of each.

    A log that has a record is not followed again. So the same call goes on where an earlier one was stopped.

    Args:
        store: a file (SQLite), made if it is not there; or ``postgresql://user@host/database``.
        machine: its description, name or file.
        logs: a file or a folder, or several.
        unit: name of the unit, if the machine has several.
        serial: serial number of the machine, if several are described alike.
        channel_map: of the logs, as `read_log`'s.
        at: when the log begins, of a single log, as ISO 8601; by default the log's clock, its name or its file says so.
        new_description: a description other than the one that the records rest on begins a history of its own.
        client: of Dask distributed; None for threads of this process.
        threads: how many; by default one for each core that this process may use.
        progress: show a bar on a terminal if it takes long.

    Returns:
        `records` of new logs, files whose logs are `known`, and `refused` ones with the reasons.

    Raises:
        HistoryError: it is no store, or the machine's records rest on another description.
        DescriptionError: a log is not there, or a value is out of range.
        UnknownNameError: no such machine or unit.

    Example:
        >>> import pathlib, tempfile, ramsight, ramsight.logs.drive_log
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> run = ramsight.simulate(boom, "work-day", load=["200 kN"], duration="1 min")
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     log = pathlib.Path(folder) / "boom_2026-03-01.csv"
        ...     ramsight.logs.drive_log.write_log(ramsight.drive_report(run), log)
        ...     for _ in range(2):
        ...         done = ramsight.history_add(f"{folder}/fleet.db", "mining-loader", log, unit="boom")
        ...         print(len(done.records), len(done.known))
        1 0
        0 1
    """
    return added(
        store, machine, logs, unit=unit, serial=serial, channel_map=channel_map, at=at,
        new_description=new_description, client=client, threads=threads, progress=progress,
    )  # fmt: skip


def added(
    store: str | Path,
    machine: str | Path | Machine,
    logs: Any,
    *,
    unit: str | None,
    serial: str,
    channel_map: AnyMap | None,
    at: str | None,
    new_description: bool,
    client: Any = None,
    threads: int | None = None,
    progress: bool = False,
    say: Callable[[str], object] = lambda text: None,
) -> Added:
    """The same; `say` is passed a line on each record."""
    check_extra("history")
    described = load_machine(machine)
    name = only_unit(described) if unit is None else unit
    passed = logs if isinstance(logs, Sequence) and not isinstance(logs, str) else [logs]
    files = logs_in([path_argument(one, "logs") for one in passed])
    if at is not None and len(files) > 1:
        raise DescriptionError("is for a single log", key="at", value=at)
    when = None if at is None else time_argument(at, "at")
    key = MachineKey(described.name, name, serial)
    following = Following(build(described, name), channel_map)
    digest, toml = description_digest(described, name), described_as(described)
    with HistoryStore(store, makes=True) as kept:
        place = kept.described(key, digest, toml, has_changed=new_description)
        with progress_bar(len(files), "following logs") as bar:
            return add_logs(
                kept, place, following, files, at=when, client=client, threads=threads,
                advance=bar.advance if progress else lambda files: None, say=say,
            )  # fmt: skip


@by_kind
def history_event(
    store: str | Path, machine: str, kind: str, at: str, *, unit: str, serial: str = "", note: str = ""
) -> bool:
    """Declare that something was done to a machine, so that its trends may step there.

    Args:
        store: as `history_add` has made it.
        machine: name of the description.
        kind: ``oil change``, ``repair`` or ``other``.
        at: when, as ISO 8601.
        unit: name of the unit.
        serial: serial number of the machine.
        note: what it was, in words.

    Returns:
        Whether it was new.

    Raises:
        HistoryError: it is no store, or has no records of the machine.
        DescriptionError: a value is out of range.

    Example:
        >>> import ramsight
        >>> ramsight.history_event("none.db", "mining-loader", "oil change", "2026-03-01", unit="boom")
        Traceback (most recent call last):
        ...
        ramsight.histories.history_store.HistoryError: none.db: there is no such file; ramsight history add makes it
    """
    check_extra("history")
    if kind not in KINDS_OF_EVENT:
        raise DescriptionError("is no kind of event", key="kind", value=kind, allowed=", ".join(KINDS_OF_EVENT))
    with HistoryStore(store) as kept:
        return kept.declare(MachineKey(machine, unit, serial), Event(time_argument(at, "at"), kind, note))


@by_kind
def history(
    store: str | Path,
    machine: str,
    *,
    unit: str | None = None,
    serial: str | None = None,
    limits: Mapping[str, float] | None = None,
) -> Dataset:
    """How a machine has changed: what each log says, and the trend through them.

    Args:
        store: as `history_add` has made it.
        machine: name of the description.
        unit: name of the unit, if there are records of several.
        serial: serial number, if there are records of several.
        limits: of quantities, over the description's [1]; by default 1.5 of the leakage.

    Returns:
        Over `time` (of each log, as dates), `duration` and `worked` [s], the oil's temperatures [K], `references`,
        `available` [1] and `consistency` [1]. Over `time` and `quantity` also `value` and `value_std`, what the log
        alone says over the description [1], NaN where it says nothing, and `trend` and `trend_std`. Over `quantity`
        `limit` [1] and the dates `limit_low`, `limit_date` and `limit_high` of an interval of 90 %, which begins with
        the last log where the limit may be passed already; not a date where none is given, and `reason` says why. The
        attributes `state` and `causes` are in words.

    Raises:
        HistoryError: it is no store.
        UnknownNameError: there are no records of such a machine, or of several.
        DescriptionError: a limit is out of range.

    Example:
        >>> import ramsight
        >>> ramsight.history("none.db", "mining-loader")
        Traceback (most recent call last):
        ...
        ramsight.histories.history_store.HistoryError: none.db: there is no such file; ramsight history add makes it
    """
    check_extra("history")
    from ramsight.histories.history_dataset import dataset_of

    return dataset_of(history_of_one(store, machine, unit, serial, limits))


@by_kind
def history_report(
    store: str | Path,
    out: str | Path,
    machine: str | None = None,
    *,
    unit: str | None = None,
    serial: str | None = None,
    limits: Mapping[str, float] | None = None,
) -> None:
    """Write a page on a fleet that needs no other file: a row a machine, and a part a machine.

    Args:
        store: as `history_add` has made it.
        out: the page, .html.
        machine: name of a description; None for all machines.
        unit: of this unit alone.
        serial: of this serial number alone.
        limits: as `history`'s.

    Raises:
        HistoryError: it is no store.
        UnknownNameError: there are no records of such a machine.
        OutputError: the page cannot be written.

    Example:
        >>> import ramsight
        >>> ramsight.history_report("none.db", "fleet.html")
        Traceback (most recent call last):
        ...
        ramsight.histories.history_store.HistoryError: none.db: there is no such file; ramsight history add makes it
    """
    check_extra("history")
    place = path_argument(out, "out")
    check_target(place, (".html",))
    write_text(report_text(store, machine, unit, serial, limits), place)


def report_text(
    store: str | Path,
    machine: str | None = None,
    unit: str | None = None,
    serial: str | None = None,
    limits: Mapping[str, float] | None = None,
) -> str:
    """The page of `history_report`, whose arguments these are."""
    check_extra("history")
    name = str(store).rpartition("@")[2] if "://" in str(store) else Path(store).name  # without what a password is in
    return fleet_page(histories(store, machine, unit, serial, limits), f"How machines change: {name}")


def histories(
    store: str | Path,
    machine: str | None = None,
    unit: str | None = None,
    serial: str | None = None,
    limits: Mapping[str, float] | None = None,
) -> list[Assessed]:
    """The histories of a store, assessed; arguments as `history_report`."""
    with HistoryStore(store) as kept:
        found = [
            History(one, kept.records(one.place), kept.events(one.key)) for one in chosen(kept, machine, unit, serial)
        ]
    return assessed(found, limits)


def history_of_one(
    store: str | Path,
    machine: str,
    unit: str | None = None,
    serial: str | None = None,
    limits: Mapping[str, float] | None = None,
) -> Assessed:
    """The history of the one machine that these names leave; arguments as `history_report`.

    Raises:
        UnknownNameError: there is none, or there are several.
    """
    found = histories(store, machine, unit, serial, limits)
    if len(found) > 1:
        raise UnknownNameError("machine", machine, [one.history.kept.key.text for one in found], str(store))
    return found[0]


def chosen(
    store: HistoryStore, machine: str | None = None, unit: str | None = None, serial: str | None = None
) -> list[Kept]:
    """The units of a store that have these names; None for any.

    Raises:
        UnknownNameError: there is none.
    """
    there = store.machines()
    asked = {"machine": machine, "unit": unit, "serial": serial}
    found = [one for one in there if all(value in (None, getattr(one.key, name)) for name, value in asked.items())]
    if not found:
        words = ", ".join(value for value in asked.values() if value) or "any"
        raise UnknownNameError("machine", words, [one.key.text for one in there], store.name)
    return found


def time_argument(text: str, name: str) -> float:
    """A time as ISO 8601 has it, as an argument [s since 1970].

    Raises:
        DescriptionError: it is none.
    """
    try:
        return instant(text)
    except ValueError:
        allowed = "as ISO 8601 has it: 2026-03-01T06:30"
        raise DescriptionError("is no time", key=name, value=text, allowed=allowed) from None
