"""The pictures of docs/reference/circuits.md: the circuit of every unit of the catalogue, as `ramsight draw` draws it.

python evaluation/drawings.py docs/images
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import ramsight


def units() -> Iterator[tuple[str, str]]:
    """Machine and unit of every circuit of the catalogue, by name."""
    for entry in ramsight.catalogue("machine"):
        for unit in ramsight.load_machine(entry.name).units:
            yield entry.name, unit


def file_name(machine: str, unit: str) -> str:
    """Name of a unit's picture."""
    return f"circuit-{machine}-{unit}.svg"


def main(folder: Path) -> None:
    """Draw them."""
    for machine, unit in units():
        ramsight.draw(machine, folder / file_name(machine, unit), unit=unit)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
