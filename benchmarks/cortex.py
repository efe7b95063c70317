"""What an exported sensor takes of a Cortex-M (arm-none-eabi-gcc, QEMU), into results/bench.json.

python benchmarks/cortex.py [--out results/bench.json]

The golden samples run on emulated processors, so that what is counted is also right. QEMU counts instructions, not
cycles: caches, waits for flash and long divisions are not in it.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from bench_file import keep

from ramsight import machine
from ramsight.deploy.c_folder import write_sensor
from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.compiler import bodies, compile_files, run, version
from ramsight.deploy.profiles import Profile

HERE = Path(__file__).parent / "cortex"
GCC, SIZE, QEMU = "arm-none-eabi-gcc", "arm-none-eabi-size", "qemu-system-arm"
UNIT, PREFIX = "boom", "ramsight_boom"
LEVEL = "-Os"
PROFILES = {
    "kalman": (Profile.KALMAN, None),
    "kalman-small, sure ends": (Profile.KALMAN_SMALL, 1e-6),
    "balance": (Profile.BALANCE, None),
}
"""Profiles, and the chance of an end that is elsewhere; None for the machine's own."""
_START_FILES = ("crti.o", "rdimon-crt0.o", "crtn.o")


@dataclass(frozen=True)
class Core:
    """A processor: how it is compiled for, and the board of QEMU that has it."""

    name: str
    options: tuple[str, ...]
    board: str
    single: bool


CORES = (
    Core("m4f_float", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"), "mps2-an386", True),
    Core("m4f_double", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"), "mps2-an386", False),
    Core("m7_float", ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"), "mps2-an500", True),
    Core("m7_double", ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"), "mps2-an500", False),
)


def measured(core: Core, folder: Path) -> dict[str, int]:
    """Bytes of code, stack and state, and instructions of a step, on one processor."""
    common = [*core.options, "-mthumb", "-std=c99", LEVEL, f"-D{PREFIX.upper()}_FLOAT={int(core.single)}"]
    common += ["-ffunction-sections", "-fdata-sections"]
    objects = compile_files([GCC, *common], bodies(folder, PREFIX), folder)
    code = sum(sum(map(int, line.split()[:2])) for line in run([SIZE, *objects], folder).splitlines()[1:])
    board = [str(HERE / "start.c"), "-T", str(HERE / "mps2.ld"), "-nostartfiles", "-Wl,--gc-sections"]
    libraries = ["-Wl,--start-group", "-lm", "-lc", "-lgcc", "-lrdimon", "-Wl,--end-group"]
    compiler = [GCC, *core.options, "-mthumb"]
    start = [run([*compiler, f"-print-file-name={name}"], folder).strip() for name in _START_FILES]

    def emulated(*sources: str) -> str:
        run([GCC, *common, *board, *start, *objects, *sources, *libraries, "-o", "image.elf"], folder)
        semihosting = ["-semihosting-config", "enable=on,target=native", "-icount", "shift=0,sleep=off"]
        return run([QEMU, "-M", core.board, "-nographic", *semihosting, "-kernel", "image.elf"], folder)

    golden = emulated("-DROUNDS=1", f"{PREFIX}_test.c")
    if "passed" not in golden:
        raise SystemExit(f"{core.name}: {golden}")
    told = emulated(*_macros(), str(HERE / "count.c"))
    found = {key: int(value) for key, value in re.findall(r"(mean|most|stack|state|saved) (\d+)", told)}
    return {
        "code_bytes": code,
        "stack_bytes": found["stack"],
        "state_bytes": found["state"],
        "saved_bytes": found["saved"],
        "step_instructions": found["mean"],
        "step_instructions_most": found["most"],
    }


def _macros() -> list[str]:
    """What the counting program calls the sensor."""
    names = {"SENSOR": "", "INPUTS": "_inputs", "OUTPUTS": "_outputs", "STEP": "_step", "START": "_start"}
    names |= {"REFERENCE": "_reference", "REAL": "_real"}
    macros = [f"-D{name}={PREFIX}{end}" for name, end in names.items()]
    headers = [f'-DHEADER="{PREFIX}.h"', f'-DGOLDEN_HEADER="{PREFIX}_golden.h"']
    return [*macros, *headers, f"-DSAVED={PREFIX.upper()}_BYTES", "-I."]


def table(found: dict[str, dict[str, int]]) -> list[str]:
    """The rows of docs/reference/c-cost.md."""
    words = {"m4f": "Cortex-M4F", "m7": "Cortex-M7"}
    rows = [
        "| processor, reals | code and constants | stack | state | saved | instructions of a step, mean | most |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, one in found.items():
        core, reals = name.split("_")
        rows.append(f"| {words[core]}, {reals} | " + " | ".join(str(value) for value in one.values()) + " |")
    return rows


def written(words: str, folder: Path) -> Path:
    """The sensor of a profile in a folder, of a machine whose ends are as sure as `PROFILES` has them."""
    profile, undeclared = PROFILES[words]
    loader = machine.load_machine("mining-loader")
    unit = loader.unit(UNIT)
    assumed = unit.assumptions.replace({"stops.undeclared": undeclared or unit.assumptions.stops.undeclared})
    sure = loader.model_copy(update={"units": {**loader.units, UNIT: unit.model_copy(update={"assumptions": assumed})}})
    out = folder / identifier_of(words)
    write_sensor(sure, UNIT, out, profile=profile, compiler="")
    return out


def profile_table(found: dict[str, dict[str, int]]) -> list[str]:
    """Profiles in floats on a Cortex-M4F."""
    rows = [
        "| profile | code and constants | stack | state | saved | instructions of a step, mean | most |",
        "|---" * 7 + "|",
    ]
    return [
        *rows,
        *(f"| {name} | " + " | ".join(str(value) for value in one.values()) + " |" for name, one in found.items()),
    ]


def renew(page: Path, mark: str, rows: list[str]) -> None:
    """Put a table into its page."""
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"
    before, _, rest = page.read_text(encoding="utf-8").partition(begin)
    _, _, after = rest.partition(end)
    page.write_text(f"{before}{begin}\n" + "\n".join(rows) + f"\n\n{end}{after}", encoding="utf-8")


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"))
    options = parser.parse_args()
    missing = [tool for tool in (GCC, SIZE, QEMU) if shutil.which(tool) is None]
    if missing:
        print(f"nothing measured on a Cortex-M: {', '.join(missing)} not found; what {options.out} has of it stays")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "sensor"
        write_sensor(machine.load_machine("mining-loader"), UNIT, folder, compiler="")
        found = {core.name: measured(core, folder) for core in CORES}
        smaller = {words: measured(CORES[0], written(words, Path(name))) for words in PROFILES}
    tools = {"cortex_compiler": version(GCC), "cortex_emulator": version(QEMU)}
    keep({**tools, "cortex": found, "cortex_profiles": smaller}, options.out)
    docs = HERE.parents[1] / "docs"
    renew(docs / "reference" / "c-cost.md", "cortex", table(found))
    renew(docs / "export.md", "cortex_profiles", profile_table(smaller))
    print("\n".join([*table(found), *profile_table(smaller)]))


if __name__ == "__main__":
    main()
