"""Damaged machine descriptions: refused in one line, or a machine whose figures are finite."""

from __future__ import annotations

import math
import re
import resource
import time
from pathlib import Path

from harness import READ, REFUSED, WRONG, Rng, Section
from mutate import mutated

CASES = 3000
_LONGEST, _LARGEST, _LINE = 2.0, 300, 800  # s, MiB, letters
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
    from ramsight.machine import catalogue, load_machine, template

    names = [name for name in ("mining-loader", "forklift-mast", "press") if name in str(catalogue.__dict__) or True]
    texts = []
    for name in names:
        try:
            texts.append(template(load_machine(name), name="mine"))
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
    from ramsight.machine import load_machine
    from ramsight.plant.ddh import build_ddh
    from ramsight.plant.machine_tables import machine_summary

    path = folder / "mine.toml"
    path.write_bytes(_damaged(texts[int(rng.integers(len(texts)))], rng))
    try:
        described = load_machine(str(path))
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


def _repeated(rng: Rng, text: str) -> str:
    """A text with something in it that is far too much: deep, wide, long, or a number that no machine has."""
    many = int(10 ** rng.uniform(0.0, 5.0))
    name, word = ("a", '"a"', "units", "u.v")[int(rng.integers(4))], "x" * many
    values = ["1" * many, "0x" + "f" * many, "1_0" * many, f"1e{many}", f"1e-{many}", f"{many}.0", "-inf", "nan"]
    values += [f'"{word}"', f'"{"1" * many} mm"', f'"1e-{many} m"', '"1e-300 m"', '"\u0661 m"', f'"1 {"m " * many}"']
    values += [f'"1 ± {" " * many}"', "1979-05-27", "[" * many, "{a=" * many, f"[{'{},' * many}]", f"[{'1,' * many}]"]
    chosen = values[int(rng.integers(len(values)))]
    each = ("k{} = 1", "[units.u{}]", "[a.b.c{}.d.e.f.g]", "[[units.x]]", '[units.u{}]\ncircuit = "eha-double-rod"')
    lines = ["\n".join(one.format(k) for k in range(many)) for one in each]
    lines += [".".join([name] * many) + " = 1", f"[{'.'.join([name] * many)}]", f"{name}{many} = {chosen}"]
    lines += [f'"{word}" = {chosen}', f'"""{word}', f"'{word}", f"#{word}"]
    numbers = list(_NUMBER.finditer(text))
    if rng.random() < 0.3 and numbers:
        match = numbers[int(rng.integers(len(numbers)))]
        return text[: match.start()] + chosen.strip('"') + text[match.end() :]
    line = lines[int(rng.integers(len(lines)))]
    return f"{line}\n{text}" if rng.random() < 0.5 else f"{text}\n{line}\n"


def _hostile(texts: list[str], rng: Rng, folder: Path) -> tuple[str, str]:
    """Refused in one line, or read, within two seconds and 300 MiB whatever it holds."""
    from ramsight.errors import MISTAKES, RamsightError
    from ramsight.machine import load_machine

    text = texts[int(rng.integers(len(texts)))] if rng.random() < 0.7 else "format = 1\n"
    for _ in range(int(rng.integers(1, 3))):
        text = _repeated(rng, text)
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    begin, outcome, said = time.process_time(), READ, [""]
    try:
        load_machine(str(path))
    except RamsightError as error:
        outcome, said = REFUSED, [str(one) for one in (error, *error.others)]
    lasted, most = time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    if lasted > _LONGEST or most > _LARGEST:
        return WRONG, f"{lasted:.1f} s, {most} MiB: {text[:60]!r}"
    if len(said) > MISTAKES + 1 or any(len(one) > _LINE or not one.isprintable() for one in said):
        return WRONG, f"{len(said)} lines of up to {max(map(len, said))} letters: {text[:60]!r}"
    return outcome, f"{most} MiB at most so far"


SECTIONS = [
    Section("description", CASES, _prepare, _check),
    Section("hostile description", CASES, _prepare, _hostile, tells=True),
]
