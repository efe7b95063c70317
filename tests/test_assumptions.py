"""What a description declares of drive, machine, thermometer and stops reaches every sensor that is made of it."""

import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from ramsight import machine, units
from ramsight.calibration import identify_replay, sensors
from ramsight.calibration.cached import cache_file
from ramsight.closed_loop import driven, loop
from ramsight.deploy import c_folder, fmu, fmu_model, profiles
from ramsight.deploy.encoder import Settings, assembly, drive_map
from ramsight.errors import DescriptionError
from ramsight.machine import Assumptions, catalogue
from ramsight.plant import linked
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.machine_tables import machine_summary
from ramsight.plant.pump import Pump
from ramsight.sensor import balance as balance_module
from ramsight.sensor import kalman as kalman_module
from ramsight.sensor import kept_sensor
from ramsight.sensor.balance import balance
from ramsight.sensor.kalman import kalman
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.status import Status

from .sensor_bench import Stepped, cycle

FIELDS = {assumed.path: assumed for assumed in machine.walk(Assumptions())}
PLACES_OF_STOPS = ("stops.retracted", "stops.extended")
CIRCUITS = {"boom": "mining-loader", "axis": "eha-test-bench", "ram": "press"}


def load(unit, declared):
    """The catalogue's machine of a unit that declares these values: path below `assumptions` -> TOML."""
    tables = {}
    for path, value in declared.items():
        group, key = path.rsplit(".", 1)
        tables.setdefault(group, []).append(f"{key} = {value}")
    text = catalogue.find("machine", CIRCUITS[unit]).path.read_text()
    for group, lines in tables.items():
        text += "\n".join(["", f"[units.{unit}.assumptions.{group}]", *lines, ""])
    return machine.loads(text, "a.toml")


def built(unit, declared):
    described = load(unit, declared)
    return build(described, unit)


def bound(path, which):
    """The lowest or the highest value that may be declared [SI]."""
    declared = FIELDS[path].declared
    return units.parse(getattr(declared, which), declared.unit)


def written(path, share):
    """A value that is this share of the way from the lowest to the highest: as TOML, and in SI.

    Stops have to leave something of the stroke.
    """
    declared = FIELDS[path].declared
    least, most = bound(path, "least"), 0.1 if path in PLACES_OF_STOPS else bound(path, "most")
    text = declared.show(least + share * (most - least))
    return f'"{text}"', declared.read(text, from_file=True)


def values(assumptions):
    return {assumed.path: assumed.value for assumed in machine.walk(assumptions)}


def same_graph(one, other):
    same = np.array_equal(one.initial, other.initial) and np.array_equal(one.parameters, other.parameters)
    return same and one.recursion.function().serialize() == other.recursion.function().serialize()


def test_every_number_of_the_assumptions_can_be_declared():
    assert {path.split(".")[0] for path in FIELDS} == {
        "integrity", "drive", "machine", "thermometer", "stops", "pressure", "shaft", "power", "inertia",
        "motor_temperature", "link_angle", "absolute_position",
    }  # fmt: skip
    assert all(assumed.declared and not assumed.given for assumed in FIELDS.values())


@given(unit=st.sampled_from(sorted(CIRCUITS)), path=st.sampled_from(sorted(FIELDS)), share=st.floats(0.001, 0.999))
def test_a_declared_value_reaches_the_unit_and_no_other_changes(unit, path, share):
    text, value = written(path, share)
    assert values(built(unit, {path: text}).assumptions) == values(Assumptions()) | {path: value}


def test_all_values_together_reach_the_unit():
    everything = {path: written(path, 0.3) for path in FIELDS}
    found = built("ram", {path: text for path, (text, _) in everything.items()}).assumptions
    assert values(found) == {path: value for path, (_, value) in everything.items()}


ONLY_SIMULATED = "absolute_position.every"
SMALL = (Kind.DESCRIBED, Kind.UNKNOWN_POSITION)


FIRST = {path.partition(".")[0]: path for path in reversed(FIELDS)}.values()


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=() if path in FIRST else pytest.mark.slow) for path in FIELDS if path != ONLY_SIMULATED],
)
def test_a_declared_value_changes_the_sensor(path):
    # Sensors of pressure and of the link's angle are taken where their noise is declared.
    beside = {"pressure.std": '"5 bar"'} if path == "pressure.lag" else {}
    if path == "drive.zero_walk":  # of a torque that has a zero error
        beside = {"drive.zero": '"1 N m"'}
    for sensor, std in (
        ("link_angle", "0.2 deg"),
        ("shaft", "0.1 deg"),
        ("power", "1 %"),
        ("motor_temperature", "1 %"),
        ("absolute_position", "2 mm"),
    ):
        if path.startswith(f"{sensor}.") and path != f"{sensor}.std":
            beside = {f"{sensor}.std": f'"{std}"'}
    changed = {**beside, path: written(path, 0.4)[0]}
    # Of all circuits the press has the smallest graph; a link that turns has the boom alone.
    name = "boom" if path.startswith("link_angle.") else "ram"
    units = [built(name, declared) for declared in (changed, beside)]
    if path == "machine.filling":  # of pumps that may starve
        units = [unit.mapped(lambda p: replace(p, filling=1e-6) if isinstance(p, Pump) else p) for unit in units]
    kinds = KINDS if "other" in path else SMALL  # another leakage is that of a hypothesis
    assert not same_graph(*(kalman(one, kinds=kinds) for one in units))


@pytest.mark.parametrize("make", [kalman, balance])
@pytest.mark.parametrize("unit", CIRCUITS)
def test_who_declares_nothing_or_the_defaults_has_the_sensor_of_the_defaults(unit, make):
    plain = built(unit, {})
    assert plain.assumptions == Assumptions()
    said = built(unit, {"drive.torque": '"0.7 %"', "drive.delay": '"20 ms"', "stops.wrong": '"0.1 %"'})
    for one in (make(plain), make(said)):
        assert same_graph(one, make(plain, Assumptions()))


def test_a_coarse_torque_makes_the_position_less_sure():
    run, log = cycle(built("boom", {}))
    log = log.isel(time=slice(300))
    found = []
    for declared in ("0.7 %", "2 %", "6 %"):
        sensor = Stepped(kalman(built("boom", {"drive.torque": f'"{declared}"'})))
        sensor.start(float(run["position"][0]))
        found.append(np.median(sensor.track(log)["position_std"]))
    assert found[0] < found[1] < found[2]


@pytest.mark.parametrize("which", ["least", "most"])
def test_a_sensor_holds_to_the_ends_of_every_range(which):
    unit = built("boom", {path: written(path, {"least": 0.0, "most": 1.0}[which])[0] for path in FIELDS})
    run, log = cycle(built("boom", {}))
    sensor = Stepped(kalman(unit))
    sensor.start(float(run["position"][0]))
    said = sensor.track(log)
    assert np.isfinite(said["position"]).all()
    assert np.isfinite(said["position_std"]).all()
    assert Status.STATE_INVALID not in said["status"]


REFUSED = [
    ({"drive.torque": '"30 %"'}, "drive.torque = '30 %': out of range", "at least 0.01 %, at most 20 %"),
    ({"drive.torque": '"0 %"'}, "drive.torque = '0 %': out of range", "at least 0.01 %"),
    ({"drive.delay": '"20 mm"'}, "drive.delay = '20 mm': 'mm' does not fit", "a time such as '20 ms'"),
    ({"drive.delay": "0.02"}, "drive.delay = 0.02: a unit is missing", "at least 0.1 ms, at most 1 s"),
    ({"drive.delay": '"nan s"'}, "drive.delay = 'nan s': expected a time", ""),
    ({"drive.tork": '"1 %"'}, "drive.tork: unknown key", "did you mean 'torque'?"),
    ({"thermometer.lag": '"-3 s"'}, "thermometer.lag = '-3 s': out of range", "at least 0 s"),
    ({"machine.leak_walk": '"1 %/h"'}, "machine.leak_walk = '1 %/h': '%/h' does not fit", "such as '1 %/sqrt(h)'"),
    ({"machine.walk": '"1 mm"'}, "machine.walk = '1 mm': 'mm' does not fit", "such as '0.2 mm/sqrt(m)'"),
    ({"machine.spring": '"3 %"'}, "machine.spring: unknown key", "known: leak"),
    ({"stops.undeclared": '"50 %"'}, "stops.undeclared = '50 %': out of range", "at most 45 %"),
    ({"stop.std": '"1 %"'}, "stop: unknown key", "did you mean 'stops'?"),
]


def test_stops_that_leave_nothing_of_the_stroke_are_refused():
    with pytest.raises(DescriptionError, match=r"stops\.retracted = .*nothing of the stroke.*less than 700 mm"):
        load("boom", {"stops.retracted": '"400 mm"', "stops.extended": '"300 mm"'})


@pytest.mark.parametrize(("declared", "start", "words"), REFUSED, ids=range(len(REFUSED)))
def test_what_cannot_be_is_refused_with_its_path_and_range(declared, start, words):
    with pytest.raises(DescriptionError) as caught:
        load("boom", declared)
    said = str(caught.value)
    assert said.startswith("a.toml: units.boom.assumptions." + start)
    assert words in said
    assert "\n" not in said


@given(path=st.sampled_from(sorted(FIELDS)), above=st.booleans(), times=st.floats(1.01, 1e6))
def test_beyond_its_range_every_value_is_refused(path, above, times):
    least, most = bound(path, "least"), bound(path, "most")
    value = most * times if above else least / times if least > 0.0 else -most * times
    with pytest.raises(DescriptionError, match=rf"a\.toml: units\.boom\.assumptions\.{path} = .*: out of range"):
        load("boom", {path: f'"{FIELDS[path].declared.show(value)}"'})


class MadeError(Exception):
    """Ends whatever makes a sensor once it is clear of which unit."""


#: all that makes a sensor of a description: where and by which name it does, and how it is made to
PLACES = {
    "C": (profiles, "kalman", lambda m, _, folder: c_folder.write_sensor(m, "boom", folder / "c", compiler="")),
    "FMU": (fmu_model, "kalman", lambda m, _, folder: fmu.write_fmu(m, "boom", folder / "boom.fmu", compiler="")),
    "encoder": (
        assembly,
        "kalman",
        lambda _, unit, __: assembly.encoder_for(unit, drive_map(5, rated_torque=35.0), Settings(6)),
    ),
    "closed loop": (
        driven,
        "kalman",
        lambda m, *_: loop.ClosedLoop(linked.build_linked(m), linked.build_linked(m), {"boom": 0.2, "bucket": 0.25}),
    ),
    "track, kalman": (kalman_module, "kalman", lambda _, unit, __: sensors.sensor_for(unit, "kalman")),
    "track, balance": (balance_module, "balance", lambda _, unit, __: sensors.sensor_for(unit, "balance")),
    "identify": (MachineModel, "of", lambda _, unit, __: identify_replay.Circuit(unit)),
}


@pytest.mark.parametrize("place", PLACES)
def test_every_place_that_makes_a_sensor_hands_on_what_is_declared(tmp_path, monkeypatch, place):
    described = load("boom", {"drive.delay": '"35 ms"', "drive.torque": '"2.5 %"'})
    module, name, make = PLACES[place]
    found = []

    def made(unit, *others, **_):
        own = [one for one in others if isinstance(one, Assumptions)]
        found.append(own[0] if own else unit.assumptions)
        raise MadeError

    monkeypatch.setattr(module, name, made)
    monkeypatch.setattr(kept_sensor, "kept", lambda key, make, *_: make())
    with pytest.raises(MadeError):
        make(described, build(described.unit("boom"), "boom"), tmp_path)
    assert found == [described.unit("boom").assumptions]
    assert (found[0].drive.delay, found[0].drive.torque) == (0.035, 0.025)


def test_a_worn_machine_and_its_table_keep_to_their_unit():
    plain, declared = built("boom", {}), built("boom", {"drive.torque": '"3 %"'})
    assert AsBuilt(leak=1.2).apply(declared).assumptions == declared.assumptions
    # A table is made of simulated runs, which know no assumptions: none has to be made again.
    assert cache_file(declared) == cache_file(plain)


def test_a_template_writes_what_is_declared_and_shows_the_defaults_as_comments():
    like = load("boom", {"drive.delay": '"35 ms"'})
    text = machine.template(like)
    assert machine.loads(text).unit("boom") == like.unit("boom")
    _, boom, bucket = text.split("assumptions.drive]")
    assert '\ndelay = "35 ms"' in boom
    assert '\n# torque = "0.7 %"' in boom
    assert '\n# delay = "20 ms"' in bucket


def test_check_and_the_schema_show_what_is_declared():
    console = Console(record=True, width=140, file=io.StringIO())
    console.print(machine_summary(load("boom", {"drive.delay": '"35 ms"'})))
    said = console.export_text()
    assert said.count("assumptions.") == 1
    assert "assumptions.drive.delay" in said
    torque = machine.json_schema()["$defs"]["AssumedDrive"]["properties"]["torque"]
    assert (torque["x-unit"], torque["x-range"]) == ("%", "at least 0.01 %, at most 20 %")
