"""A sensor's C as WebAssembly: compiled by zig, with no imports, and the ES module that runs it."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np

from ramsight._version import __version__
from ramsight.arrays import Array
from ramsight.deploy.c_folder import golden_samples
from ramsight.deploy.c_function import asset, headings, template
from ramsight.deploy.c_sensor import ROW, input_words, output_words, sensor_source
from ramsight.deploy.c_step import identifier_of
from ramsight.deploy.compiler import STRICT, compile_files, run, zig_for
from ramsight.deploy.credentials import Export, credentials
from ramsight.engine.kept import keep, key_of, read_kept
from ramsight.machine.description import Machine
from ramsight.output import check_folder, whole_folder
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import VALIDITIES, Status
from ramsight.sensor.thresholds import START_STD
from ramsight.sensor.virtual_sensor import VirtualSensor

STEPS = 4
"""Sum of what `advance` is called with while a sensor is written."""
_LAST = "README.md"  # moved last: where it is, the folder is whole
_TARGET = ("-target", "wasm32-wasi")  # for its libm; of the host it asks nothing, which is checked
# Nothing is fused, so that it rounds as elsewhere. What protects a stack would ask the host for random numbers.
_OPTIONS = (*STRICT, "-O2", "-ffp-contract=off", "-fno-stack-protector")
_STACK = 65536  # bytes, five times what a step takes; zig puts it first, so that an overflow traps
_LINKED = ("-mexec-model=reactor", "-s", "-lm", f"-Wl,-z,stack-size={_STACK}")
_SAID = re.compile(r"^[0-9]+ samples: .*$", flags=re.MULTILINE)


@dataclass(frozen=True)
class WrittenWasm:
    """What was written."""

    folder: Path  # where
    files: tuple[str, ...]  # names of the files
    bytes: int  # of the module
    tested: str  # what the golden samples in Node said; "" if there is no Node here


@dataclass(frozen=True)
class CompiledWasm:
    """A sensor as WebAssembly, and what JavaScript knows of it."""

    code: bytes  # the module
    # machine, unit, stroke [m], names of inputs and outputs, and each status' validity and text
    facts: Mapping[str, object]


def write_wasm(
    machine: Machine, unit: str, out: str | Path, *, advance: Callable[[int], object] = lambda count: None
) -> WrittenWasm:
    """Write a unit's `kalman` sensor as WebAssembly into a folder, which appears whole or not at all.

    Args:
        machine: the machine.
        unit: name of its unit.
        out: the folder; made if it is not there. Files of an earlier export are replaced, others stay.
        advance: called with the parts of the work, of `STEPS`, that are done.

    Raises:
        DescriptionError: no sensor knows the unit's circuit.
        OutputError: the folder cannot be written.
        CompilerError: the package ziglang is missing, or the golden samples fail in Node.
    """
    out = Path(out)
    check_folder(out)
    zig_for("WebAssembly")  # before the work
    built = build(machine, unit)
    sensor, prefix = kalman(built), f"ramsight_{identifier_of(unit)}"
    made = wasm_of(sensor, built, machine.name)
    advance(2)
    rows, said, start = golden_samples(sensor, built)
    advance(1)
    common = headings(prefix, machine.name, f"Virtual position sensor of the {unit}")
    texts = {
        f"{prefix}.mjs": template("web/module.mjs", facts=json.dumps(made.facts, indent=2), **common),
        f"{prefix}.d.mts": _types(sensor, common),
        "sensor.mjs": asset("web/sensor.mjs"),
        "test.mjs": asset("web/test.mjs"),
        "golden.json": _golden(rows, said, start, sensor),
        "package.json": _package(prefix, machine.name, unit),
    }
    content = {f"{prefix}.wasm": made.code, **{name: text.encode() for name, text in texts.items()}}
    with whole_folder(out, _LAST) as draft:
        for name, data in content.items():
            (draft / name).write_bytes(data)
        tested = _tested(draft)
        passed = "golden samples passed by Node" if tested else ""
        own = credentials(Export(machine, built, "sensor", ("wasm",), passed), content)
        measured = tested or "No Node was found where this was exported, so nothing was run."
        about = template(
            "web/README.md", unit=unit, machine=machine.name, p=prefix, bytes=len(made.code), samples=len(rows),
            units=_unit_table(sensor), name=_name(machine.name, unit), measured=measured,
        )  # fmt: skip
        for name, text in {**own, _LAST: about}.items():
            (draft / name).write_text(text, encoding="utf-8")
    advance(1)
    return WrittenWasm(out, (*content, *own, _LAST), len(made.code), tested)


def wasm_of(sensor: VirtualSensor, unit: HydraulicUnit, machine: str) -> CompiledWasm:
    """A sensor's C compiled to a module without imports.

    Raises:
        CompilerError: the package ziglang is missing, or its compiler refuses the C.
    """
    prefix = f"ramsight_{identifier_of(unit.name)}"
    source = sensor_source(sensor, unit, prefix, machine, single=False)
    inputs, outputs = input_words(sensor), output_words(sensor)
    glue = template("web/glue.c", p=prefix, P=prefix.upper(), inputs=len(inputs), outputs=len(outputs))
    facts = {
        "machine": machine,
        "unit": unit.name,
        "stroke": unit.cylinder.stroke,
        "inputs": [camel(name) for name in inputs],
        "outputs": [camel(name) for name in outputs],
        "status": {int(status): [status.validity, status.text] for status in Status},
    }
    return CompiledWasm(_compiled({**source.files, "glue.c": glue}), facts)


def camel(name: str) -> str:
    """A name as JavaScript has it.

    Example:
        >>> camel("oil_temperature"), camel("time")
        ('oilTemperature', 'time')
    """
    first, *more = name.split("_")
    return first + "".join(word.capitalize() for word in more)


def _compiled(files: Mapping[str, str]) -> bytes:
    """A module of C files; what the same compiler made of the same files before is taken again."""
    zig = zig_for("WebAssembly")
    key = key_of("wasm", metadata.version("ziglang"), _OPTIONS, _LINKED, files)
    if (found := read_kept(key)) is not None:
        return b64decode(found["module"])
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        sources = sorted(name for name in files if name.endswith(".c"))
        objects = compile_files([zig, "cc", *_TARGET, *_OPTIONS], sources, folder)
        run([zig, "cc", *_TARGET, *objects, *_LINKED, "-o", "sensor.wasm"], folder)
        code = (folder / "sensor.wasm").read_bytes()
    keep(key, {"module": b64encode(code).decode()})
    return code


def _types(sensor: VirtualSensor, common: Mapping[str, object]) -> str:
    """TypeScript's view of the module: each input and output with unit and meaning."""

    def fields(words: Mapping[str, tuple[str, str]], mark: str) -> str:
        return "\n".join(
            f"  /** [{unit}] {text} */\n  {camel(name)}{mark}: number;".replace("]  */", "] */")
            for name, (unit, text) in words.items()
            if name != "status"
        )

    validities = " | ".join(json.dumps(one) for one in VALIDITIES)
    inputs, outputs = fields(input_words(sensor), "?"), fields(output_words(sensor), "")
    return template("web/module.d.mts", inputs=inputs, outputs=outputs, validities=validities, **common)


def _unit_table(sensor: VirtualSensor) -> str:
    """Inputs and outputs as JavaScript names them, a row each of a Markdown table."""
    rows = [("in", *row) for row in input_words(sensor).items()]
    rows += [("out", *row) for row in output_words(sensor).items()]
    return "\n".join(f"| {way}: `{camel(name)}` | {unit} | {text} |" for way, name, (unit, text) in rows)


def _golden(rows: Array, said: Array, start: float, sensor: VirtualSensor) -> str:
    """Golden samples as JSON, in which a value that is missing is null."""
    names = [*("time", "motor_speed", "motor_torque", "oil_temperature", "reference"), *sensor.further]
    assert len(names) == len(ROW) + len(sensor.further)
    tables = {
        name: [[value if np.isfinite(value) else None for value in row] for row in table.tolist()]
        for name, table in (("inputs", rows), ("outputs", said))
    }
    columns = {camel(name): place for place, name in enumerate(names)}
    return json.dumps({"start": start, "std": START_STD, "columns": columns, **tables}, separators=(",", ":"))


def _package(prefix: str, machine: str, unit: str) -> str:
    """The folder as a package of Node's."""
    about = {
        "name": _name(machine, unit),
        "version": __version__,
        "private": True,
        "type": "module",
        "main": f"{prefix}.mjs",
        "types": f"{prefix}.d.mts",
        "scripts": {"test": "node test.mjs"},
    }
    return json.dumps(about, indent=2) + "\n"


def _name(machine: str, unit: str) -> str:
    return re.sub(r"[^a-z0-9-]+", "-", f"ramsight-{machine}-{unit}".lower())


def _tested(folder: Path) -> str:
    """What the golden samples say in Node; "" if there is none here.

    Raises:
        CompilerError: they fail.
    """
    node = shutil.which("node")
    if node is None:
        return ""
    with tempfile.TemporaryDirectory() as place:  # Node runs nothing in a folder whose name is not UTF-8
        copied = shutil.copytree(folder, Path(place) / "export")
        said = run([node, "test.mjs"], copied)
        return f"Node {run([node, '--version'], copied).strip()}: {_SAID.findall(said)[0]}"
