"""Damaged machine descriptions: refused in one line, or a machine whose figures are finite."""

from __future__ import annotations

import math
import re
from pathlib import Path

from harness import READ, REFUSED, WRONG, Rng, Section
from mutate import mutated

CASES = 3000
_NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_VALUES = [
    "0",
    "-1",
    "1e-300",
    "1e300",
    "inf",
    "nan",
    "-0.0",
    "1e5",
    "99999999999999999999",
    "0.001",
    '""',
    "true",
    "[]",
]
_UNITS = [("mm", "m"), ("bar", "Pa"), ("bar", "mm"), ("kN", "N m"), ("cm3/rev", "l"), ("rpm", "rad/s"), ("kg", "K")]
_LINES = ["[units.boom]", "circuit = 'eha-double-rod'", "name = 7", "[[units]]", "x = {", "oil = 'water'", "[linkage]"]


def _prepare(folder: Path) -> list[str]:
    from ramsight.machine import catalogue, load, template

    names = [name for name in ("mining-loader", "forklift-mast", "press") if name in str(catalogue.__dict__) or True]
    texts = []
    for name in names:
        try:
            texts.append(template(load(name), name="mine"))
        except Exception:  # not every version has them all
            continue
    return texts


def _damaged(text: str, rng: Rng) -> bytes:
    for _ in range(int(rng.integers(1, 4))):
        kind, lines = int(rng.integers(6)), text.splitlines()
        place = int(rng.integers(len(lines)))
        numbers = list(_NUMBER.finditer(text))
        if kind in (0, 1) and numbers:
            match = numbers[int(rng.integers(len(numbers)))]
            text = text[: match.start()] + _VALUES[int(rng.integers(len(_VALUES)))] + text[match.end() :]
        elif kind == 2:
            del lines[place]
            text = "\n".join(lines)
        elif kind == 3:
            one, other = _UNITS[int(rng.integers(len(_UNITS)))]
            parts = text.split(one)
            if len(parts) > 1:
                cut = int(rng.integers(1, len(parts)))
                text = one.join(parts[:cut]) + other + one.join(parts[cut:])
        elif kind == 4:
            lines.insert(place, _LINES[int(rng.integers(len(_LINES)))])
            text = "\n".join(lines)
        else:
            return mutated(text.encode(), rng)
    return text.encode()


def _check(texts: list[str], rng: Rng, folder: Path) -> tuple[str, str]:
    from ramsight.errors import RamsightError
    from ramsight.machine import load
    from ramsight.plant.ddh import build_ddh
    from ramsight.plant.machine_tables import machine_summary

    path = folder / "mine.toml"
    path.write_bytes(_damaged(texts[int(rng.integers(len(texts)))], rng))
    try:
        described = load(str(path))
        machine_summary(described, None)
        for name in described.units:
            if described.unit(name).circuit != "ddh":
                continue
            built = build_ddh(name, described.unit(name))
            figures = (built.travel_per_radian, built.cylinder.stroke, built.max_speed, built.max_velocity)
            if not all(math.isfinite(figure) and figure for figure in figures):
                return WRONG, f"{name}: {figures}"
    except RamsightError as error:
        text = str(error)
        if len(text) > 2000 or len(text.splitlines()) > 1:
            raise
        return REFUSED, text
    return READ, ""


SECTIONS = [Section("description", CASES, _prepare, _check)]
