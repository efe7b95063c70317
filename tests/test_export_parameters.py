"""One build serves the machines of a kind: another machine's numbers make it that machine's sensor."""

import ctypes
import importlib.resources
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from ramsight import machine
from ramsight.deploy.c_sensor import MachineTable, initializer, inputs_of, machine_table, sensor_source, table_header
from ramsight.deploy.compiler import STRICT, find_compiler, library
from ramsight.deploy.fmu import write_fmu
from ramsight.deploy.golden import faulty_day
from ramsight.deploy.machine_parameters import parameter_set, write_parameters
from ramsight.engine.recursion import replay
from ramsight.errors import DescriptionError
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman

CHANGES = {
    "stiff": {
        '"0.6 GPa"': '"0.9 GPa"', '"2 l"': '"1.2 l"', '"3 m"': '"2 m"', '"32 mm"': '"25 mm"',
        '"1200 kN/mm"': '"1500 kN/mm"',
    },
    "heavy": {
        '"4000 kg"': '"5200 kg"', '"8.5 kN/(m/s)"': '"12 kN/(m/s)"', '"1.5 kN"': '"2.0 kN"', '"28/47"': '"28/45"',
    },
}  # fmt: skip
OTHER_KIND = {'stroke = { value = "0.7 m"': 'stroke = { value = "0.55 m"'}
"""A number that the graph holds: another one is another kind."""
SHIM = """
#include <math.h>
#include "ramsight_boom.h"
#include "stiff.h"
#include "heavy.h"
int refused(void) {
  ramsight_boom s;
  ramsight_boom_machine other = ramsight_boom_described;
  ramsight_boom_inputs in = {0, 0, 0, 300};
  ramsight_boom_outputs out;
  other.kind ^= 1u;
  if (ramsight_boom_of(&s, &other) || ramsight_boom_of(&s, 0)) return -1;
  ramsight_boom_init(&s);
  ramsight_boom_step(&s, &in, &out);
  if (ramsight_boom_resume(&s, 7, 0, 0) != RAMSIGHT_BOOM_NOTHING) return -2;
  return out.status == RAMSIGHT_BOOM_STATE_INVALID;
}
int track(int which, long count, const double *in, double *out, double start) {
  const ramsight_boom_machine *all[] = {&ramsight_boom_described, &ramsight_boom_of_stiff, &ramsight_boom_of_heavy};
  ramsight_boom s;
  ramsight_boom_inputs sample;
  ramsight_boom_outputs said;
  if (!ramsight_boom_of(&s, all[which])) return 0;
  if (ramsight_boom_resume(&s, 7, 0, 0) != RAMSIGHT_BOOM_NOTHING) return 0;
  ramsight_boom_start(&s, start, 1e-3);
  for (long k = 0; k < count; k++, in += 5) {
    sample.time = in[0]; sample.motor_speed = in[1]; sample.motor_torque = in[2]; sample.oil_temperature = in[3];
    ramsight_boom_reference(&s, in[4]);
    ramsight_boom_step(&s, &sample, &said);
    *out++ = said.position; *out++ = said.position_std; *out++ = said.status;
  }
  return 1;
}
"""


def written(folder, name, changes):
    """The loader with some of its boom's numbers changed."""
    text = (importlib.resources.files("ramsight.machine") / "catalogue" / "machines" / "mining-loader.toml").read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    file = folder / f"{name}.toml"
    file.write_text(text.replace('name = "mining-loader"', f'name = "{name}"'))
    return machine.load_machine(file)


@pytest.fixture(scope="module")
def stiff(fleet):
    """The second machine's unit, sensor and table, made once."""
    unit = build(fleet[1][1].unit("boom"), "boom")
    sensor = kalman(unit)
    return unit, sensor, machine_table(sensor, "ramsight_boom")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """The loader and two of its kind, with the folder that their numbers are in."""
    folder = tmp_path_factory.mktemp("fleet")
    machines = [machine.load_machine("mining-loader"), *(written(folder, *one) for one in CHANGES.items())]
    return folder, machines


def python_track(sensor, rows, start):
    sensor.start(start)
    state = np.array([sensor.state[name] for name in sensor.recursion.state])
    return replay(sensor.recursion, inputs_of(rows), sensor.parameters, state)[:, [0, 1, 4]]


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")
def test_one_build_is_the_sensor_of_three_machines(fleet, stiff):
    folder, machines = fleet
    units = [build(one.unit("boom"), "boom") for one in machines]
    sensors = [kalman(units[0]), stiff[1], kalman(units[2])]
    source = sensor_source(sensors[0], units[0], "ramsight_boom", "mining-loader", single=False, tabled=True)
    assert write_parameters(machines[2], "boom", folder / "heavy.h") == len(source.table.numbers)
    texts = {"heavy.h": (folder / "heavy.h").read_text(), "stiff.h": table_header(stiff[2], "ramsight_boom", "stiff")}
    library(find_compiler(), {**source.files, **texts, "shim.c": SHIM}, folder / "fleet.so", *STRICT, "-O0")
    built = ctypes.CDLL(str(folder / "fleet.so"))
    assert built.refused() == 1
    pointer = ctypes.POINTER(ctypes.c_double)
    rows, start = faulty_day(units[2], duration=45.0, every=30.0, seed=1)
    rows, found = np.ascontiguousarray(rows), []
    for which, sensor in enumerate(sensors):
        out = np.empty((len(rows), 3))
        arguments = rows.ctypes.data_as(pointer), out.ctypes.data_as(pointer), ctypes.c_double(start)
        assert built.track(which, ctypes.c_long(len(rows)), *arguments)
        expected = python_track(sensor, rows, start)
        assert np.abs(out[:, :2] - expected[:, :2]).max() < 1e-12
        assert (out[:, 2] == expected[:, 2]).all()
        found.append(out[:, 0])
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(found[one] - found[other]).max() > 1e-5, "the machines differ"


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")
def test_an_fmu_takes_another_machines_numbers(fleet, stiff, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    _, machines = fleet
    unit, sensor, made = stiff
    done = write_fmu(machines[0], "boom", tmp_path / "boom.fmu", tabled=True)
    (tmp_path / "stiff.ssv").write_text(parameter_set("stiff", made.numbers))
    numbers = read(tmp_path / "stiff.ssv")
    described = {v.name: v for v in fmpy.read_model_description(str(done.path)).modelVariables}
    assert set(numbers) == {name for name in described if name.startswith("machine.")}
    rows, start = faulty_day(unit, duration=30.0, every=None, seed=1)
    names = ("time", "motor_speed", "motor_torque", "oil_temperature")
    table = np.array([tuple(row[:4]) for row in rows], dtype=[(name, float) for name in names])
    found = fmpy.simulate_fmu(
        str(done.path),
        stop_time=rows[-1, 0],
        output_interval=0.02,
        input=table,
        start_values={"start_position": start, "start_known": True, **numbers},
        output=["position"],
    )
    expected = python_track(sensor, rows, start)[:, 0]
    assert np.abs(found["position"][1:] - expected[:-1]).max() < 1e-6
    with pytest.raises(Exception, match="fmi2ExitInitializationMode failed"):
        fmpy.simulate_fmu(str(done.path), stop_time=0.1, start_values={"machine.kind": numbers["machine.kind"] + 1.0})


def read(file):
    """Numbers of an SSV by name."""
    space = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
    root = ElementTree.parse(file).getroot()
    assert (root.tag, root.get("version")) == (f"{space}ParameterSet", "1.0")
    return {one.get("name"): float(one[0].get("value")) for one in root[0]}


def test_numbers_of_a_plant_are_its_fmus_parameters(fleet, tmp_path):
    _, machines = fleet
    values = []
    for one in machines:
        write_parameters(one, "boom", tmp_path / "boom.ssv", what="plant")
        values.append(read(tmp_path / "boom.ssv"))
    assert values[0].keys() == values[1].keys() == values[2].keys()
    assert [one["hose_a.length"] for one in values] == [3.0, 2.0, 3.0]
    assert values[2]["cylinder.mass"] == 5200.0
    with pytest.raises(DescriptionError, match="has no parameters"):
        write_parameters(machines[0], "boom", tmp_path / "x.ssv", what="control")
    with pytest.raises(DescriptionError, match="is of a sensor alone"):
        write_fmu(machines[0], "boom", tmp_path / "x.fmu", what="control", tabled=True)


@pytest.mark.slow
def test_a_machine_with_another_stroke_is_of_another_kind(fleet, stiff):
    unit = build(written(fleet[0], "other", OTHER_KIND).unit("boom"), "boom")
    other, table = machine_table(kalman(unit), "ramsight_boom"), stiff[2]
    assert other.kind != table.kind
    assert other.identity != table.identity


def test_a_table_is_c_that_keeps_every_digit():
    table = MachineTable(0xAB, 0xCD, 0.1 + 0.2, {"x": 1e-300}, {"k_stroke": 0.7, "k_1": float("inf")})
    text = initializer(table, "p")
    assert "UINT32_C(0x000000AB), UINT32_C(0x000000CD), 0.30000000000000004" in text
    assert "(p_real)(INFINITY) /* k_1 */" in text
    assert "static const p_machine p_of_left = {" in table_header(table, "p", "left")
    names = ["kind", "identity", "stroke", "start.x", "constant.stroke", "constant.1"]
    assert list(table.numbers) == [f"machine.{name}" for name in names]
