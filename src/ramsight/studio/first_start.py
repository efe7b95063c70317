"""What a machine's first start has to compile, in pieces: several processes share them, and each piece is made once.

Whoever makes a piece has its lock, which the system takes back from a process that is killed. A mark beside the machine
code says that a piece is made; without a cache's folder there are no marks, and each process makes what it needs.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial

from ramsight.calibration.sensors import sensor_for
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.engine.kept import keep, key_of, read_kept
from ramsight.engine.object_code import made_for
from ramsight.engine.private_folder import cache_directory
from ramsight.errors import RamsightError
from ramsight.machine.description import Machine
from ramsight.plant.linked import LinkedMachine
from ramsight.plant.unit import HydraulicUnit
from ramsight.studio.knobs import SENSORS, Knobs
from ramsight.studio.lifts import Lifts
from ramsight.studio.rig import START, advanced, live_plant, parts_of
from ramsight.system import lock, processors

_LOOK = 0.05  # s, from one look at what other processes make to the next
_MOST = 2  # processes that help: a machine has three large pieces
_WORDS = {
    "kalman": "the kalman sensor of the {unit}",
    "machine": "the machine's equations",
    "balance": "the balance of the {unit}",
    "weighing": "the weighing",
}
"""Of each kind of piece, what takes longest first."""

Parts = Callable[[], tuple[LinkedMachine | None, dict[str, HydraulicUnit]]]
"""Gives what runs of a machine."""


@dataclass(frozen=True)
class Piece:
    """One of what has to be compiled."""

    name: str  # tells it from the others
    words: str  # what it is
    make: Callable[[], object]  # compiles it, or loads it if that was done before


def pieces(machine: Machine) -> list[Piece]:
    """All that the first sample of a machine in the studio needs, what takes longest first.

    Example:
        >>> from ramsight import machine
        >>> [piece.name for piece in pieces(machine.load_machine("press"))]
        ['kalman_ram', 'machine', 'balance_ram']
    """
    units = [next(iter(machine.units))] if machine.linkage is None else list(machine.linkage.cylinders)
    parts = cache(partial(parts_of, machine))
    made = {kind: [_piece(kind, partial(_sensor, parts, unit, kind), unit) for unit in units] for kind in SENSORS}
    made["machine"] = [_piece("machine", partial(_plant, parts))]
    if machine.linkage is not None and machine.linkage.payload is not None:
        made["weighing"] = [_piece("weighing", partial(Lifts, machine, SAMPLE_PERIOD))]
    return [piece for kind in _WORDS for piece in made.get(kind, ())]


def _piece(kind: str, make: Callable[[], object], unit: str = "") -> Piece:
    return Piece("_".join(filter(None, (kind, unit))), _WORDS[kind].format(unit=unit), make)


def _sensor(parts: Parts, name: str, kind: str) -> None:
    unit, warm = parts()[1][name], Knobs().oil_temperature
    sensor = sensor_for(unit, kind)
    sensor.start(START * unit.cylinder.stroke)
    sensor.step(0.0, 0.0, 0.0, warm)


def _plant(parts: Parts) -> None:
    linked, sheet = parts()
    begin = {name: START * unit.cylinder.stroke for name, unit in sheet.items()}
    plant = live_plant(linked, sheet, begin, Knobs().oil_temperature, 0.0)
    advanced(plant, dict.fromkeys(sheet, 0.0), 0.0)
    plant.inside()


def is_made(machine: Machine) -> bool:
    """Whether nothing of a machine is left to be shared: it was compiled before, or cannot be kept (`key_of`)."""
    return not _left(_keys(machine))


def _keys(machine: Machine) -> dict[Piece, str | None]:
    """Of each piece the key of its mark."""
    return {piece: _key(piece, machine) for piece in pieces(machine)}


def _left(keys: dict[Piece, str | None]) -> list[Piece]:
    """Pieces that have to be made; none of a machine that cannot be kept."""
    return [] if None in keys.values() else [piece for piece, key in keys.items() if not _is_marked(key)]


def _key(piece: Piece, machine: Machine) -> str | None:
    return key_of(f"made_{piece.name}", machine, made_for())


def _is_marked(key: str | None) -> bool:
    return read_kept(key) is not None


def helpers() -> int:
    """How many processes it takes beside one, to use this computer."""
    return min(processors() - 1, _MOST)


def make(machine: Machine, tell: Callable[[str], object] = lambda text: None, *, waits: bool = True) -> None:
    """Have all pieces made that are not: by this process, or by others meanwhile.

    Args:
        tell: is called with what is made now, in words.
        waits: whether to wait for what others make.

    Raises:
        RamsightError: what is described cannot be built or simulated.
    """
    keys = _keys(machine)
    left = _left(keys)
    while left:
        for piece in list(left):
            with _alone(keys[piece]) as mine:
                if mine and not _is_marked(keys[piece]):
                    tell(_words(piece, keys))
                    piece.make()
                    keep(keys[piece], {})
                if mine:
                    left.remove(piece)
        left = [piece for piece in left if not _is_marked(keys[piece])]
        if left and not waits:
            return
        if left:
            tell(_words(left[0], keys))
            time.sleep(_LOOK)


def _words(piece: Piece, keys: dict[Piece, str | None]) -> str:
    done = sum(_is_marked(key) for key in keys.values())
    return f"first start: compiling {piece.words}, {done} of {len(keys)} are ready; the next start is quick"


@contextmanager
def _alone(key: str | None) -> Iterator[bool]:
    """Have a piece alone; whether this process has it. Where nothing can be locked, it does."""
    try:
        held = lock(cache_directory() / f"{key}.lock")
    except BlockingIOError:
        yield False
        return
    except OSError:
        yield True
        return
    try:
        yield True
    finally:
        held.release()


def help_making(machine: Machine) -> None:
    """Make what nobody makes, in a process that does nothing else."""
    gc.disable()  # a quarter of the time that a graph takes; the process ends soon
    try:
        make(machine, waits=False)
    except (RamsightError, KeyboardInterrupt):  # whoever needs it gets the same error
        return
