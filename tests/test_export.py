"""Exported C says what Python says: with doubles, with floats, with faults, after a power loss, under sanitizers."""

import ctypes
import json
import os
import re
import struct
import subprocess
import tempfile
import zlib
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.exported_run import CompiledSensor
from ramsight import machine
from ramsight.cli import app
from ramsight.deploy.c_alike import Collapsed
from ramsight.deploy.c_cut import cut
from ramsight.deploy.c_folder import write_sensor
from ramsight.deploy.c_function import PLAIN, Term
from ramsight.deploy.c_functions import Handed, functions
from ramsight.deploy.c_lines import Scribe
from ramsight.deploy.c_sensor import inputs_of, sensor_source
from ramsight.deploy.c_stays import staying
from ramsight.deploy.c_step import by_section, field_of, live_marks
from ramsight.deploy.compiler import (
    STRICT,
    CompilerError,
    bodies,
    compile_files,
    find_compiler,
    footprint,
    library,
    run,
)
from ramsight.deploy.golden import faulty_day
from ramsight.engine.cache import instructions
from ramsight.engine.graph import graph_of
from ramsight.engine.recursion import replay
from ramsight.errors import OutputError
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.kalman import kalman
from ramsight.sensor.persistence import StateFile, forgotten
from ramsight.sensor.status import Status

from .made_once import anew

COMPILER = find_compiler()
pytestmark = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
LOADER = machine.load_machine("mining-loader")


@pytest.fixture(scope="module", params=["boom", pytest.param("bucket", marks=pytest.mark.slow)])
def exported(request):
    """Sensor, C and a day with faults: its rows, its start, and what Python says of it."""
    unit = build_ddh(request.param, LOADER.unit(request.param))
    sensor = kalman(unit)
    source = sensor_source(sensor, unit, f"ramsight_{request.param}", "mining-loader", single=False)
    rows, start = faulty_day(unit, duration=500.0, every=40.0, seed=3)
    return sensor, source, rows, start


@pytest.fixture(scope="module")
def compiled(exported):
    """The C of `exported` in both precisions, `compiled(single)`; one unit's as it is delivered, with `-O2`."""
    sensor, source, _, _ = exported
    options = () if source.prefix == "ramsight_boom" else ("-O0",)

    @cache
    def of(single):
        return CompiledSensor(source, sensor, COMPILER, single=single, options=options)

    return of


def by_python(sensor, rows, start):
    sensor.start(None if np.isnan(start) else start)
    state = np.array([sensor.state[name] for name in sensor.recursion.state])
    return replay(sensor.recursion, inputs_of(rows), sensor.parameters, state)


def test_a_log_with_faults_has_them(exported):
    sensor, _, rows, start = exported
    said = set(by_python(sensor, rows, start)[:, 4].astype(int).tolist())
    expected = {Status.INPUT_LOST, Status.TIME_FROZEN, Status.INPUT_GAP, Status.IMPLAUSIBLE_SPEED}
    expected |= {Status.IMPLAUSIBLE_TORQUE, Status.TEMPERATURE_LOST, Status.OK}
    assert {int(status) for status in expected} <= said
    assert np.isnan(rows[:, 1:4]).any()
    assert (np.diff(rows[:, 0]) <= 0.0).any()


@pytest.mark.parametrize("known", [True, False])
def test_doubles_say_the_same_to_a_picometre(exported, compiled, known):
    sensor, _, rows, start = exported
    start = start if known else np.nan
    expected = by_python(sensor, rows, start)
    found = compiled(False).track(rows, start)
    assert np.isfinite(expected[:, 0]).mean() > 0.1
    np.testing.assert_allclose(found[:, 0], expected[:, 0], rtol=0.0, atol=1e-12)  # NaN in the same samples
    assert (found[:, 4] == expected[:, 4]).all()
    scale = np.maximum(np.nanmax(np.abs(expected), axis=0), 1e-9)
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=1e-9)


def same_but_for_rounding(found, expected):
    """Where a piston stands or moves again is found a sample earlier or later: a share of what is known of it then."""
    off, std = np.abs(found[:, 0] - expected[:, 0]), expected[:, 1]
    return bool((off <= np.maximum(0.05e-3, 0.03 * std)).all())


def test_floats_stay_within_a_twentieth_of_a_millimetre(exported, compiled):
    sensor, _, rows, start = exported
    expected = by_python(sensor, rows, start)
    found = compiled(True).track(rows, start)
    assert same_but_for_rounding(found, expected)
    assert (found[:, 4] != expected[:, 4]).mean() < 1e-3


@pytest.mark.parametrize("single", [False, True])
def test_a_clock_that_has_run_for_half_a_year_is_no_worse(exported, compiled, single):
    sensor, _, rows, start = exported
    late = rows[:5000].copy()
    late[:, 0] += 2.0**24  # s
    found, expected = compiled(single).track(late, start), by_python(sensor, late, start)
    assert same_but_for_rounding(found, expected) if single else np.abs(found - expected)[:, 0].max() < 1e-12


def test_not_even_nan_everywhere_makes_a_position_of_nan(exported, compiled):
    sensor, _, _, start = exported
    rows = np.full((50, 5), np.nan)
    found = compiled(False).track(rows, start)
    np.testing.assert_array_equal(found[:, 4], Status.INPUT_LOST)
    np.testing.assert_allclose(found, by_python(sensor, rows, start))


@pytest.mark.slow
def test_sanitizers_find_nothing_and_the_golden_samples_pass(tmp_path):
    done = write_sensor(LOADER, "boom", tmp_path / "boom", compiler="")
    options = ["-O0", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-DROUNDS=2"]
    for single in (0, 1):
        sources = [*bodies(done.folder, "ramsight_boom"), "ramsight_boom_test.c", "-lm", "-o", f"golden{single}"]
        macro = f"-DRAMSIGHT_BOOM_FLOAT={single}"
        subprocess.run([COMPILER, *STRICT, *options, macro, *sources], cwd=done.folder, check=True)
        # Another library may come before the sanitizer's; leaks are looked for by a tracer that may be forbidden here.
        environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0"}
        environment.pop("LD_PRELOAD", None)
        program = str(done.folder / f"golden{single}")
        ran = subprocess.run([program], capture_output=True, text=True, env=environment, check=False)
        assert ran.returncode == 0, ran.stderr
        assert "passed" in ran.stdout
        assert ", 0 missing, 0 other statuses" in ran.stdout


def test_it_is_strict_c99_that_converts_nothing_unsaid_and_calls_libm_alone(tmp_path):
    done = write_sensor(LOADER, "bucket", tmp_path / "bucket", compiler="")
    more = ["-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Wstrict-prototypes", "-Wmissing-prototypes"]
    for single in (0, 1):
        macro = f"-DRAMSIGHT_BUCKET_FLOAT={single}"
        command, sources = [COMPILER, *STRICT, *more, macro, "-O0"], bodies(done.folder, "ramsight_bucket")
        objects = compile_files(command, sources, done.folder)
        symbols = run(["nm", *objects], done.folder).splitlines()
        needed = {line.split()[-1] for line in symbols if " U " in line and "ramsight_bucket_step_" not in line}
        assert needed <= {
            "exp", "log", "tanh", "sqrt", "pow", "expf", "logf", "tanhf", "sqrtf", "powf", "memset", "memcpy",
        }  # fmt: skip
        assert [line for line in symbols if re.search(r" [bBdDC] ", line)] == []  # no variable that lasts


def test_headers_of_two_units_live_in_one_program(tmp_path):
    (tmp_path / "both").mkdir()
    for name in ("boom", "bucket"):
        for file, text in source_of(name).files.items():
            (tmp_path / "both" / file).write_text(text)
    (tmp_path / "both" / "main.c").write_text(
        '#include "ramsight_boom.h"\n#include "ramsight_bucket.h"\n'
        "int main(void) { static ramsight_boom a; static ramsight_bucket b;"
        " ramsight_boom_init(&a); ramsight_bucket_init(&b); return a.position < b.position; }\n"
    )
    sources = sorted(file.name for file in (tmp_path / "both").glob("*.c"))
    run([COMPILER, *STRICT, *sources, "-lm", "-o", "main"], tmp_path / "both")


NOTHING, RESUMED, OLDER, MOVED = range(4)


class Slots:
    """An exported boom with its slots, by ctypes."""

    def __init__(self, library: Path, source):
        self.c = ctypes.CDLL(str(library))
        self.c.ramsight_boom_start.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double]
        header = source.files["ramsight_boom.h"]
        behind = header.split("} ramsight_boom_slots;")[1]
        self.names = re.findall(r"^  (?:double|ramsight_boom_real) (\w+);$", behind, re.M)
        self.sensor = (ctypes.c_double * (len(self.names) + 16))()
        self.slots = [(ctypes.c_ubyte * (20 + 8 * len(self.names)))() for _ in range(2)]
        self.c.ramsight_boom_init(self.sensor)

    def begin(self, position=0.3, instance=7):
        """Nothing is resumed, the position is entered, and it stands under load."""
        assert self.resume(instance) == NOTHING
        assert self.c.ramsight_boom_start(self.sensor, position, 1e-3) == 1
        return self.rest(0.0)

    def put(self, state):
        fields = {field_of(name): value for name, value in state.items()}
        for k, name in enumerate(self.names):
            self.sensor[k] = fields[name]

    def get(self):
        return dict(zip(self.names, self.sensor[: len(self.names)], strict=True))

    def rest(self, begin, speed=0.0):
        """Stand under load for 1.2 s; the slots that were written."""
        sample, said, written = (ctypes.c_double * 4)(), (ctypes.c_double * 32)(), []
        for k in range(60):
            sample[:] = [begin + 0.02 * k, speed, 2.0, 313.15]
            self.c.ramsight_boom_step(self.sensor, sample, said)
            written += self.keep()
        return written

    def keep(self, starts=0):
        scratch = (ctypes.c_ubyte * len(self.slots[0]))()
        place = self.c.ramsight_boom_keep(self.sensor, starts, scratch)
        if place >= 0:
            self.slots[place][:] = scratch
        return [] if place < 0 else [place]

    def resume(self, instance=7):
        return self.c.ramsight_boom_resume(self.sensor, instance, *self.slots)


def source_of(name):
    """The C of a sensor of the loader."""
    unit = build_ddh(name, LOADER.unit(name))
    return sensor_source(kalman(unit), unit, f"ramsight_{name}", "mining-loader", single=False)


@pytest.fixture(scope="module")
def boom_library(tmp_path_factory):
    """The library that the C of the boom's sensor becomes, which has no variable that lasts, and that C."""
    file, source = tmp_path_factory.mktemp("boom") / "boom.so", source_of("boom")
    library(COMPILER, dict(source.files), file, *STRICT, "-O0")
    return file, source


@pytest.fixture
def slots(boom_library):
    return Slots(*boom_library)


def test_a_state_resumes_as_in_python(tmp_path, slots):
    unit = build_ddh("boom", LOADER.unit("boom"))
    sensor, c = kalman(unit), slots
    file = StateFile(tmp_path / "boom.state", sensor)
    assert set(c.names) == {field_of(name) for name in sensor.recursion.state}
    assert c.begin() == [1, 0, 1], "both slots exist at once, and neither has the position yet"
    rows, start = faulty_day(unit, duration=60.0, every=None, seed=2)
    sensor.start(start)
    for row in rows[:600]:
        sensor.step(*row[:4])
    file.save()
    c.put(sensor.state)
    (place,) = c.keep(starts=1)
    assert c.resume() == MOVED
    assert c.get()["position_known"] == 0.0
    known = sensor.learned
    assert [c.get()[field_of(name)] for name in known] == [sensor.state[name] for name in known]

    content = bytearray(file.path.read_bytes())
    content[-100] ^= 1
    file.path.write_bytes(content)
    assert file.resume().older
    c.slots[place][20] ^= 1  # torn
    assert c.resume() == OLDER
    kept = {name: c.get()[field_of(name)] for name in sensor.recursion.state}
    assert kept == pytest.approx(forgotten(sensor, kept))
    assert c.keep() == [place], "the whole one stays"


def test_what_is_resumed_is_what_was_kept(slots):
    slots.begin()
    before = slots.get()
    assert slots.resume() == RESUMED
    after = slots.get()
    known = [name for name in slots.names if re.fullmatch(r"hypotheses_\d_(?!.*position).*", name)]
    assert len(known) == 5 * (8 + 36 + 1)
    assert [after[name] for name in known] == pytest.approx([before[name] for name in known], rel=1e-3)
    pressures = [name for name in slots.names if re.fullmatch(r"load_circuit_pressure_[a-z]+_[ab]", name)]
    assert pressures
    assert [after[name] for name in pressures] == pytest.approx([before[name] for name in pressures], abs=1e4)
    assert after["position"] == pytest.approx(before["position"], abs=1e-6)
    assert after["position_variance"] > before["position_variance"] * (1.0 - 5e-3), "kept a moment before, at rest"
    assert (after["intake_started"], after["intake_clocked"]) == (0.0, 0.0)
    assert slots.keep() == [], "it rests there still"
    assert slots.keep(starts=1) == [0]
    assert slots.resume() == MOVED


def test_a_drive_that_loses_its_power_first_does_not_take_the_position_with_it(slots):
    slots.begin()
    assert slots.rest(1.2, speed=np.nan) == []
    assert slots.resume() == RESUMED
    assert slots.rest(0.0, speed=np.nan) == []
    assert slots.keep(starts=1) == [0], "but a motor that is commanded counts as moving"
    assert slots.resume() == MOVED


def test_only_slots_that_were_saved_one_after_the_other_give_a_position(slots):
    slots.resume()
    slots.c.ramsight_boom_start(slots.sensor, 0.3, 1e-3)
    contents = {}  # by the number of the save; odd ones are in slot 1
    for k in range(4):
        slots.rest(1.2 * k)
        contents |= {int.from_bytes(bytes(slot)[4:8], "little"): bytes(slot) for slot in slots.slots}
        slots.keep(starts=1)
        contents |= {int.from_bytes(bytes(slot)[4:8], "little"): bytes(slot) for slot in slots.slots}
    assert len(contents) > 6
    for even in (number for number in contents if number % 2 == 0):
        for odd in (number for number in contents if number % 2):
            slots.slots[0][:], slots.slots[1][:] = contents[even], contents[odd]
            rests = int.from_bytes(contents[max(even, odd)][8:12], "little") == 0x54534552
            expected = (RESUMED if rests else MOVED) if abs(even - odd) == 1 else OLDER
            assert slots.resume() == expected


def test_slots_of_another_instance_are_as_good_as_erased(slots):
    slots.begin()
    left = [bytes(slot) for slot in slots.slots]
    for instance in (0, 6, 8, 7 << 8, 0xFFFFFFFF):
        assert slots.resume(instance) == NOTHING
        assert slots.get()["position_known"] == 0.0
    slots.begin(0.6, instance=8)
    right = [bytes(slot) for slot in slots.slots]
    assert slots.resume(8) == RESUMED
    for place in (0, 1):  # one slot of each
        slots.slots[place][:], slots.slots[1 - place][:] = left[place], right[1 - place]
        assert (slots.resume(7), slots.resume(8)) == (OLDER, OLDER)
        assert slots.get()["position_known"] == 0.0


@pytest.mark.parametrize("filler", [0x00, 0xFF])
def test_an_erased_slot_takes_the_position_with_it(slots, filler):
    """A power loss between erasing and writing; the other slot may be stale."""
    slots.begin()
    for erased in (0, 1):
        whole = bytes(slots.slots[erased])
        slots.slots[erased][:] = bytes([filler]) * len(whole)
        assert slots.resume() == OLDER
        assert slots.get()["position_known"] == 0.0
        slots.slots[erased][:] = whole
    assert slots.resume() == RESUMED
    assert slots.c.ramsight_boom_resume(slots.sensor, 7, slots.slots[0], None) == OLDER


@pytest.mark.slow
def test_every_damaged_bit_is_noticed(slots):
    slots.begin()
    for place in (0, 1):
        for bit in range(0, 8 * len(slots.slots[place]), 7):
            slots.slots[place][bit // 8] ^= 1 << bit % 8
            assert slots.resume() == OLDER
            slots.slots[place][bit // 8] ^= 1 << bit % 8
    assert slots.resume() == RESUMED


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("position", np.nan), ("position", 5.0), ("position_variance", -1e-6), ("hypotheses_0_leakage", np.inf),
        ("hypotheses_2_covariance_compliance_compliance", -1e-9), ("position_known", 7.0),
    ],
)  # fmt: skip
def test_a_state_that_cannot_be_is_not_resumed_even_with_a_good_checksum(slots, name, value):
    slots.begin()
    for place in (0, 1):
        slot = bytearray(slots.slots[place])
        at = 16 + 8 * slots.names.index(name)
        slot[at : at + 8] = struct.pack("<d", value)
        slot[-4:] = struct.pack("<I", zlib.crc32(bytes(slot[:-4])))
        slots.slots[place][:] = bytes(slot)
        assert slots.resume() == (OLDER if place == 0 else NOTHING)


@pytest.mark.slow
def test_the_same_machine_gives_the_same_bytes(tmp_path):
    press = machine.load_machine("press")
    one = write_sensor(press, "ram", tmp_path / "one", compiler="")
    with anew():
        other = write_sensor(press, "ram", tmp_path / "other", compiler="")
    assert sorted(one.files) == sorted(str(f.relative_to(one.folder)) for f in one.folder.rglob("*") if f.is_file())
    for name in one.files:
        assert (one.folder / name).read_bytes() == (other.folder / name).read_bytes()


@pytest.mark.slow
def test_a_step_takes_little_stack(tmp_path):
    done = write_sensor(LOADER, "boom", tmp_path / "boom", compiler="")
    found = footprint(COMPILER, done.folder, "ramsight_boom", single=False, optimised="-O2")
    assert found.stack < 13 * 1024
    assert found.state < 4096
    assert found.code < 250 * 1024


PARTS = ("Input check", "Balance", "Contacts", "Update", "Status", "Results")


def test_the_step_stands_in_the_order_of_the_pipe(exported):
    """A file a part, in order, and no part needs what one behind it says: the compiler saw to the latter."""
    _, source, _, _ = exported
    body = source.files[f"{source.prefix}.c"]
    called = re.findall(rf"^  {source.prefix}_step_(\w+)\(", body, flags=re.MULTILINE)
    files = [source.files[f"{source.prefix}_step_{name}.c"] for name in called]
    titles = [re.search(r"^/\* (\w[\w ]*?): .* \*/$", text, flags=re.MULTILINE)[1] for text in files]
    assert tuple(titles) == PARTS
    inputs, balance, contacts, update, status, results = files
    assert "s->load_circuit_pressure" not in inputs
    assert "s->load_circuit_pressure" in balance
    assert "EXP(" in inputs + balance or "POW(" in inputs + balance, "viscosity"
    assert len(balance) > 0.1 * sum(map(len, files))
    assert "s->hypotheses_0_covariance_position_leakage" not in contacts
    assert "s->hypotheses_0_covariance_position_leakage" in update
    assert len(update) > len(status)
    writes = [len(re.findall(r"\bs->\w+ = |\bout->\w+ = ", text)) for text in files]
    assert writes[:-1] == [0] * 5
    assert writes[-1] > 400
    assert "hypotheses_0_covariance_position_leakage = " in results


def test_functions_are_of_some_hundred_lines_and_what_hypotheses_share_stands_once(exported):
    _, source, _, _ = exported
    texts = [text for name, text in source.files.items() if "_step_" in name]
    functions_of = re.compile(r"\{\n(.*?)\n\}\n", flags=re.DOTALL)
    lengths = [len(body.split("\n")) for text in texts for body in functions_of.findall(text)]
    assert len(lengths) > 40
    assert max(lengths) < 600
    assert sum(lengths) < 20_000  # 28 000 where each hypothesis has its own
    assert sum(text.count("k < EACH") for text in texts) > 10


def test_operations_stand_by_their_parts_and_behind_what_they_need():
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    first, unused = ca.sin(x), ca.cos(y)
    second = first * y
    function = ca.Function("f", [x, y], [ca.exp(second) + y * y, ca.vertcat(first, unused), second])
    graph = graph_of(instructions(function))
    assert live_marks(graph, 1) == {(1, 0), (2, 0)}
    ordered, parts = by_section(graph, 1, 2)
    assert parts == sorted(parts)
    assert all(source < k for k, node in enumerate(ordered.nodes) for source in node.sources)
    part_of = {node.code: part for node, part in zip(ordered.nodes, parts, strict=True)}
    assert (part_of[ca.OP_SIN], part_of[ca.OP_MUL], part_of[ca.OP_EXP]) == (0, 1, 2)
    assert [output for output, _ in ordered.results] == [(0, 0)]


def _in_place(next_state, before=(2.0, 3.0), on=1.0):
    """A step that writes a state over itself, and what a run of it leaves."""
    s, flag = ca.SX.sym("s", 2), ca.SX.sym("on")
    function = ca.Function("f", [s, flag], [ca.vertcat(*next_state(s[0], s[1], flag))])
    graph = graph_of(instructions(function))
    scribe = Scribe(
        Collapsed(graph, [0] * len(graph.nodes)),
        lambda argument, k: Term("s->on" if argument else f"s->s{k}"),
        lambda _, k, term: f"s->s{k} = {term.text};",
        PLAIN,
        {0: 0},
    )
    parts = [cut(f"part_{k}", lines) for k, lines in enumerate(scribe.parts(1))]
    written = functions(*staying(parts, scribe.values), {"s": Handed("state"), "w": Handed("work")})
    members = "\n".join(written.work) or "int none;"
    body = "\n".join(written.texts.values())
    program = f"""#include <stdio.h>
    typedef double real;
    #define R(x) (x)
    typedef struct {{ double s0, s1, on; }} state;
    typedef struct {{ {members} }} work;
    {body}
    int main(void) {{
      state kept = {{{before[0]}, {before[1]}, {on}}}, *s = &kept;
      work w;
      {" ".join(written.calls)}
      printf("%.17g %.17g", s->s0, s->s1);
    }}"""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "f.c").write_text(program)
        run([COMPILER, "-std=c99", "f.c", "-o", "f"], Path(folder))
        said = [float(word) for word in run([str(Path(folder) / "f")], Path(folder)).split()]
    return body, said, function(list(before), on).full().ravel().tolist()


@pytest.mark.parametrize("on", [0.0, 1.0])
@pytest.mark.parametrize(
    ("next_state", "guarded"),
    [
        pytest.param(lambda a, b, on: (ca.if_else(on, a, a + b), ca.if_else(on, b, a * b)), True, id="kept if"),
        pytest.param(lambda a, b, on: (ca.if_else(on, a + b, a), ca.if_else(on, a * b, b)), True, id="new if"),
        pytest.param(lambda a, b, on: (ca.if_else(on, b, a), ca.if_else(on, a, b)), True, id="swapped if"),
        pytest.param(lambda a, b, on: (b, a), False, id="swapped"),
        pytest.param(lambda a, b, on: (ca.if_else(on, b, 1.0), a + 1.0), False, id="the other one's place"),
        pytest.param(lambda a, b, on: (c := ca.if_else(on, a, b), c * c), False, id="used as well"),
    ],
)
def test_a_state_that_stays_is_not_written_and_none_is_read_behind_its_writing(next_state, guarded, on):
    body, said, expected = _in_place(next_state, on=on)
    assert said == expected
    assert ("if (" in body) == guarded


def test_the_folder_says_how_it_is_called_and_in_which_units(tmp_path):
    done = write_sensor(LOADER, "boom", tmp_path / "boom", compiler="")
    text, header = ((done.folder / name).read_text() for name in ("README.md", "ramsight_boom.h"))
    headings = re.findall(r"^## (.*)", text, flags=re.MULTILINE)
    assert headings == ["Call order", "Units", "Power loss", "Size and time"]
    for struct_name, letter in (("inputs", "in"), ("outputs", "out")):
        (body,) = re.findall(rf"typedef struct {{\n([^}}]*)}} ramsight_boom_{struct_name};", header)
        members = re.findall(r"^  \w+ (\w+);", body, flags=re.MULTILINE)
        assert re.findall(rf"^\| `{letter}\.(\w+)` \| \S", text, flags=re.MULTILINE) == members
    called = set(re.findall(r"`(ramsight_boom_\w+)\(", text))
    assert called == {f"ramsight_boom_{name}" for name in ("resume", "init", "start", "reference", "step", "keep")}


def test_the_export_page_quotes_what_a_cortex_takes(script):
    root = Path(__file__).parent.parent
    cortex = script("cortex", "benchmarks")
    found = json.loads((root / "results" / "bench.json").read_text())
    page = (root / "docs" / "reference" / "c-cost.md").read_text()
    assert "\n".join(cortex.table(found["cortex"])) in page
    assert found["cortex_compiler"] in page
    assert set(found["cortex"]) == {core.name for core in cortex.CORES}


def test_statuses_and_their_texts_are_in_the_header(exported):
    _, source, _, _ = exported
    header, body = source.files[f"{source.prefix}.h"], source.files[f"{source.prefix}.c"]
    for status in Status:
        assert f"{source.prefix.upper()}_{status.name} = {int(status)}," in header
        assert f'"{status.text}"' in body


def test_the_export_page_quotes_the_benchmark():
    root = Path(__file__).parent.parent
    found = json.loads((root / "results" / "bench.json").read_text())
    page = "".join((root / "docs" / f"{name}.md").read_text() for name in ("export", "reference/c-cost"))
    quoted = [f"| {found['export_samples']} samples |"]
    for build_name in ("double", "float"):
        quoted.append(f"| {build_name} | {found[f'export_{build_name}_error_m']:.1e} |")
        for level in ("O2", "Os"):
            f = found[f"export_{build_name}_{level}"]
            quoted.append(f"| {build_name}, -{level} | {f['code_bytes']} | {f['stack_bytes']} | {f['state_bytes']} |")
            quoted.append(f"| {f['step_ns']} ns |")
    assert [figure for figure in quoted if figure not in page] == []
    assert found["export_samples"] >= 1_000_000
    assert found["export_double_error_m"] < 1e-9
    assert found["export_double_days_apart"] == 0
    assert found["export_float_error_without_faults_m"] < 2e-3
    assert found["export_float_days_apart"] <= 0.04 * found["export_days"]
    assert found["export_double_O2"]["step_ns"] <= 5000


def test_a_compiler_that_fails_leaves_nothing(tmp_path):
    with pytest.raises(CompilerError, match="false failed"):
        write_sensor(LOADER, "boom", tmp_path / "boom", compiler="/bin/false")
    assert list(tmp_path.iterdir()) == []


def test_places_that_cannot_be_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        write_sensor(LOADER, "boom", tmp_path / "file")
    with pytest.raises(OutputError, match="there is no directory"):
        write_sensor(LOADER, "boom", tmp_path / "none" / "boom")
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


@pytest.mark.slow
def test_the_verb_exports_what_it_says(tmp_path, monkeypatch):
    out = tmp_path / "boom"
    done = CliRunner().invoke(app, ["export", "c", "mining-loader", "--unit", "boom", "--out", str(out), "--single"])
    assert done.exit_code == 0, done.output
    assert "ns a step" in done.output
    assert "#define RAMSIGHT_BOOM_FLOAT 1" in (out / "ramsight_boom.h").read_text()
    assert "| float, -O2 |" in (out / "README.md").read_text()
    help_text = CliRunner().invoke(app, ["export", "c", "--help"]).output
    assert "Example:\n    ramsight export c mining-loader" in help_text
