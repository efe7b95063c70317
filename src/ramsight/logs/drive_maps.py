"""The catalogue of maps: channel maps of drives by name, each with its source, and what is tried of it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ramsight import bounded_toml
from ramsight.logs.frames import EXTENDED

FOLDER = Path(__file__).parent / "drives"
_MESSAGE = re.compile(r"^BO_ ([0-9]+) ", re.MULTILINE)


@dataclass(frozen=True)
class DriveMap:
    """A map of the catalogue."""

    name: str  # what `--map` calls it
    title: str
    source: str  # where its frames are described
    tried: str
    path: Path
    columns: frozenset[str] = frozenset()  # of a table by which it is known; none where it is of frames

    @property
    def frames(self) -> frozenset[int]:
        """Identifiers of its frames, bit 31 set for an extended one; none where a node-ID is in them."""
        dbc = self.path.with_suffix(".dbc")
        return frozenset(map(int, _MESSAGE.findall(dbc.read_text(encoding="utf-8")))) if dbc.exists() else frozenset()


@cache
def drive_maps() -> tuple[DriveMap, ...]:
    """All of them, by name.

    Example:
        >>> [one.name for one in drive_maps()][:2]
        ['brusa-dmc5', 'c300']
    """
    found = []
    for path in sorted(FOLDER.glob("*.toml")):
        said = bounded_toml.loads(path.read_text(encoding="utf-8"))["drive"]
        found.append(
            DriveMap(path.stem, said["title"], said["source"], said["tried"], path, frozenset(said.get("columns", ())))
        )
    return tuple(found)


def catalogued(name: str | Path) -> Path | None:
    """The file of a map of the catalogue by its name; None if there is none, or a file of that name."""
    if Path(name).suffix or Path(name).exists():
        return None
    return next((one.path for one in drive_maps() if one.name == str(name)), None)


def recognised(seen: Collection[int], names: Collection[str] = ()) -> Iterator[DriveMap]:
    """The drives whose frames, or whose columns, are all in a log.

    Args:
        seen: identifiers of its frames, bit 31 set for an extended one.

    Example:
        >>> [one.name for one in recognised([0x23A, 0x23B, 0x181])]
        ['dmoc645']
    """
    for one in drive_maps():
        if (one.frames and one.frames <= set(seen)) or (one.columns and one.columns <= set(names)):
            yield one


def known_by(one: DriveMap) -> str:
    """By what a drive is known in a log, in a few words."""
    listed = ", ".join(f"{key & ~EXTENDED:X}h" for key in sorted(one.frames))
    return f"frames {listed}" if listed else f"columns {', '.join(sorted(one.columns))}"
