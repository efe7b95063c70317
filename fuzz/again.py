"""One case once more, with its traceback and the damaged file kept: python fuzz/again.py SECTION CASE [--seed 1]."""

from __future__ import annotations

import argparse
import zlib
from importlib import import_module
from pathlib import Path

import numpy as np
from run import MODULES


def main() -> None:
    """Prepare a section in a folder and try one case in this process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("section")
    parser.add_argument("case", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=Path("/tmp/fuzz-again"))
    options = parser.parse_args()
    options.folder.mkdir(exist_ok=True)
    sections = [one for name in MODULES for one in import_module(name).SECTIONS if one.name == options.section]
    prepared = sections[0].prepare(options.folder)
    rng = np.random.default_rng([options.seed, zlib.crc32(options.section.encode()), options.case])
    print(sections[0].check(prepared, rng, options.folder), f"in {options.folder}", sep="\n")


if __name__ == "__main__":
    main()
