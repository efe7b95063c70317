"""Small changes that break the code, each tried against the tests that are to notice it: results/mutants.json.

python evaluation/mutants.py --out results/mutants.json [--only TEXT]

With --only the other results in the file stay as they are.

The changes are the table mutants.toml. Each is made in a temporary copy of the tree, the tests that the table names run
on it until the first failure, and the mutant is killed if one fails. The results do not depend on the machine.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ramsight.output import write_text

ROOT = Path(__file__).parent.parent
TABLE = Path(__file__).with_suffix(".toml")
COPIED = (
    "benchmarks", "docs", "evaluation", "examples", "film", "fuzz", "package", "reproduction", "results",
    "src", "tests", "typings",
)  # fmt: skip
PATIENCE = 900.0  # s; tests that take longer than that are taken to have failed


@dataclass(frozen=True)
class Mutant:
    """A change of one place."""

    file: str  # below src/ramsight, or of a folder beside src
    # old, new: text that stands in it once, and what stands there instead
    old: str
    new: str
    tests: str  # files below tests/, and options of pytest
    reason: str = ""  # of one that no test kills: why that is so

    @property
    def place(self) -> str:
        """The file and the line that changes."""
        text = self.text(ROOT)
        return f"{self.file}:{1 + text[: text.index(self.old)].count(chr(10))}"

    def path(self, root: Path) -> Path:
        """Where the file is in a tree."""
        inside = root / "src" / "ramsight" / self.file
        return inside if inside.exists() else root / self.file

    def text(self, root: Path) -> str:
        """The file's text in a tree.

        Raises:
            SystemExit: the text to be changed does not stand in it exactly once.
        """
        text = self.path(root).read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise SystemExit(f"{self.file}: {self.old!r} stands there {text.count(self.old)} times, not once")
        return text


def mutants() -> list[Mutant]:
    """All of the table."""
    return [Mutant(**row) for row in tomllib.loads(TABLE.read_text(encoding="utf-8"))["mutant"]]


def copied(to: Path) -> None:
    """Copy the tree, without what is made."""
    ignored = shutil.ignore_patterns("__pycache__", "gallery")
    for name in COPIED:
        shutil.copytree(ROOT / name, to / name, ignore=ignored)
    for file in ROOT.iterdir():
        if file.is_file():
            shutil.copy(file, to)


def survives(mutant: Mutant, root: Path) -> bool:
    """Whether the named tests pass although the code is broken."""
    file, text = mutant.path(root), mutant.text(root)
    file.write_text(text.replace(mutant.old, mutant.new), encoding="utf-8")
    words = shlex.split(mutant.tests)
    tests = [f"tests/{word}" if word.endswith(".py") else word for word in words]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "not slow", *tests]
    try:
        done = subprocess.run(
            command,
            cwd=root,
            env={**os.environ, "PYTHONPATH": str(root / "src"), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE,
        )
    except subprocess.TimeoutExpired:
        return False
    finally:
        file.write_text(text, encoding="utf-8")
    if done.returncode not in {0, 1}:  # nothing was tried
        raise SystemExit(f"{mutant.place}: {mutant.tests}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.returncode == 0


def tried(chosen: list[Mutant]) -> Iterator[dict[str, str]]:
    """Each mutant with what became of it."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        copied(root)
        for number, mutant in enumerate(chosen, 1):
            outcome = "survived" if survives(mutant, root) else "killed"
            print(f"{number} of {len(chosen)}: {mutant.place} {outcome}", flush=True)
            row = {"place": mutant.place, "old": mutant.old, "new": mutant.new, "tests": mutant.tests}
            yield row | {"outcome": outcome} | ({"reason": mutant.reason} if mutant.reason else {})


def main() -> None:
    """Try the mutants and write what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=None, help="results, JSON")
    parser.add_argument("--only", default="", help="those whose file has this in its name")
    asked = parser.parse_args()
    chosen = [mutant for mutant in mutants() if asked.only in mutant.file]
    for mutant in chosen:
        mutant.text(ROOT)
    rows = list(tried(chosen))
    if asked.only and asked.out is not None and asked.out.exists():
        # By file and text: the lines of what was not tried may have moved.
        again = {(mutant.file, mutant.old): mutant.place for mutant in mutants() if mutant not in chosen}
        for row in json.loads(asked.out.read_text(encoding="utf-8"))["mutants"]:
            place = again.get((row["place"].split(":")[0], row["old"]))
            rows += [row | {"place": place}] if place else []
        rows.sort(key=lambda row: [mutant.place for mutant in mutants()].index(row["place"]))
    survivors = [row for row in rows if row["outcome"] == "survived"]
    print(f"{len(rows) - len(survivors)} killed, {len(survivors)} survived")
    if asked.out is not None:
        write_text(json.dumps({"mutants": rows}, indent=1, ensure_ascii=False) + "\n", asked.out)
    if any(not row.get("reason") for row in survivors):
        raise SystemExit("a mutant survived without a reason")


if __name__ == "__main__":
    main()
