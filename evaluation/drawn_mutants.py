"""Mutants of the sensor that are drawn and not chosen: results/drawn_mutants.json.

python evaluation/drawn_mutants.py --out results/drawn_mutants.json

Of every place in the files below where an operator, a comparison, a number or a choice can be another one, so many are
drawn by a seed. Each is made in a temporary copy of the tree; the tests of the sensor run on it until the first
failure. A mutant survives if none fails. With --only N that one alone is tried.
"""

from __future__ import annotations

import argparse
import ast
import json
import random
from collections.abc import Iterator
from pathlib import Path

from mutants import ROOT, Mutant, tried

from ramsight.output import write_text

FILES = (
    "sensor/belief/bank.py",
    "sensor/belief/measurement.py",
    "sensor/belief/update.py",
    "sensor/belief/mixture.py",
    "sensor/belief/reach.py",
    "sensor/belief/renewal.py",
    "sensor/contacts/contact.py",
    "sensor/contacts/contact_release.py",
    "sensor/contacts/press.py",
    "sensor/circuit/load.py",
    "sensor/report/report.py",
    "sensor/report/stated.py",
    "sensor/report/status_rules.py",
)
TESTS = (
    "test_sensor_boundaries test_belief_guards test_reach test_pressing test_mutants_sensor test_sensor_stages "
    "test_sensor_pieces test_hypotheses test_emptiness test_mode test_closed_volume test_reading "
    "test_repeated_contacts test_contact test_constants test_load_observer test_kalman"
)
_FILES_OF_TESTS = " ".join(f"{name}.py" for name in TESTS.split())
_SWAPPED = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Lt: ">", ast.Gt: "<", ast.LtE: ">", ast.GtE: "<",
}  # fmt: skip
_CALLED = {"all_of": "any_of", "any_of": "all_of", "fmax": "fmin", "fmin": "fmax", "negated": "count"}


def places(file: str) -> Iterator[Mutant]:
    """Every change of a file that is tried, in the order of the text."""
    text = (ROOT / "src" / "ramsight" / file).read_text(encoding="utf-8")
    lines = [0]
    for line in text.splitlines(keepends=True):
        lines.append(lines[-1] + len(line.encode()))
    content = text.encode()

    def at(line: int | None, column: int | None) -> int:
        assert line is not None
        assert column is not None
        return lines[line - 1] + column

    def changed(first: int, last: int, new: str) -> Iterator[Mutant]:
        begin, end = content.rfind(b"\n", 0, first) + 1, content.find(b"\n", last)
        while content.count(content[begin:end]) != 1:  # as much of the text as stands there once
            end = content.find(b"\n", end + 1)
        old = content[begin:end].decode()
        yield Mutant(file, old, (content[begin:first] + new.encode() + content[last:end]).decode(), _FILES_OF_TESTS)

    inside = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    for node in {id(one): one for function in inside for part in function.body for one in ast.walk(part)}.values():
        if isinstance(node, ast.BinOp | ast.Compare):
            left = node.left
            operator, right = (
                (node.op, node.right) if isinstance(node, ast.BinOp) else (node.ops[0], node.comparators[0])
            )
            first, last = at(left.end_lineno, left.end_col_offset), at(right.lineno, right.col_offset)
            between = content[first:last].decode()
            sign = between.strip(" ()\n")
            if type(operator) in _SWAPPED and sign and "\n" not in between:
                yield from changed(first, last, between.replace(sign, _SWAPPED[type(operator)], 1))
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            last = at(node.func.end_lineno, node.func.end_col_offset)
            if name in _CALLED:
                yield from changed(last - len(name), last, _CALLED[name])
            if name == "if_else":
                one, other = node.args[1], node.args[2]
                first, end = at(one.lineno, one.col_offset), at(other.end_lineno, other.end_col_offset)
                middle = content[at(one.end_lineno, one.end_col_offset) : at(other.lineno, other.col_offset)].decode()
                new = f"{ast.get_source_segment(text, other)}{middle}{ast.get_source_segment(text, one)}"
                yield from changed(first, end, new)
        elif isinstance(node, ast.Constant) and type(node.value) is float:
            first, last = at(node.lineno, node.col_offset), at(node.end_lineno, node.end_col_offset)
            yield from changed(first, last, "1.0" if node.value == 0.0 else repr(2.0 * node.value))


def drawn(number: int, seed: int) -> list[Mutant]:
    """So many changes, by the seed; none twice."""
    found = [mutant for file in FILES for mutant in places(file)]
    return random.Random(seed).sample(found, number)  # nothing secret


def main() -> None:
    """Try them and write what became of each."""
    asks = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asks.add_argument("--out", type=Path, help="results, JSON")
    asks.add_argument("--number", type=int, default=60)
    asks.add_argument("--seed", type=int, default=1)
    asks.add_argument("--only", type=int, help="the number of one of them")
    asks.add_argument("--list", action="store_true", help="list them and try none")
    asked = asks.parse_args()
    chosen = drawn(asked.number, asked.seed)
    chosen = chosen if asked.only is None else [chosen[asked.only - 1]]
    for k, mutant in enumerate(chosen, start=1):
        print(f"{k}: {mutant.place}\n  - {mutant.old.strip()}\n  + {mutant.new.strip()}", flush=True)
    rows = [] if asked.list else list(tried(chosen))
    if asked.out is not None:
        write_text(json.dumps({"seed": asked.seed, "mutants": rows}, indent=1, ensure_ascii=False) + "\n", asked.out)


if __name__ == "__main__":
    main()
