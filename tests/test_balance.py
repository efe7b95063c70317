"""The balance of every circuit, against the plant that it was derived from."""

import math
from dataclasses import dataclass, replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from ramsight.plant.as_built import AsBuilt
from ramsight.plant.balance import FACTORS, _share_of, without_friction
from ramsight.plant.balance import balance as with_friction
from ramsight.plant.drive import IdealDrive
from ramsight.plant.hose import Hose
from ramsight.plant.limits import limits_of
from ramsight.plant.model import casadi_model
from ramsight.plant.pump import Pump
from ramsight.plant.unit import pumped_into, side_nodes
from ramsight.plant.valve import Orifice, ReliefValve

from .plant_bench import CIRCUITS, UNITS, tabulated

WARM = 313.15


def balance(unit):
    """The balance of a piston that slides freely, which is what the plant without friction is held against."""
    return with_friction(without_friction(unit))


CONVERGED = 40  # iterations after which nothing changes
STATES = 6
CLOSED = [name for name, unit in UNITS.items() if "pressure_reservoir" in balance(unit).states]
LOADER = [name for name in UNITS if name.startswith("mining-loader")]


@pytest.fixture(scope="module")
def bare():
    """A unit as the balance takes it to be, built here independently: a piston without friction, stops and mass."""
    cache = {}

    def make(unit):
        if unit not in cache:
            none = dict.fromkeys(("coulomb_friction", "breakaway_friction", "viscous_friction", "stop_stiffness"), 0.0)
            cylinder = replace(unit.cylinder, **none, mass=1e-4 * unit.cylinder.mass)
            drive = IdealDrive("drive", unit.drive.inertia)
            cache[unit] = casadi_model(replace(unit, cylinder=cylinder, drive=drive))
        return cache[unit]

    return make


def parameters(unit, temperature=WARM):
    found = balance(unit)
    return found.parameters_at(list(found.values), temperature)


def rate(plant, z, speed, load, temperature=WARM, **changes):
    p = plant.p(oil_temperature=temperature, **changes)
    return np.array(plant(x=z, u=[speed, load], slope=0.0, p=p)["dx"])[:, 0]


def tight(plant):
    """Parameters of pumps that do not leak."""
    return {name: 0.0 for name in plant.parameters if name.endswith(".leak_factor")}


def mean_rate(plant, z0, z, speed, load, temperature=WARM):
    """Of a step: what leaks is the mean of before and after it, all else is that of its end."""
    leaks = [
        rate(plant, at, speed, load, temperature) - rate(plant, at, speed, load, temperature, **tight(plant))
        for at in (z0, z)
    ]
    return rate(plant, z, speed, load, temperature, **tight(plant)) + 0.5 * (leaks[0] + leaks[1])


def look(plant, z, speed, load, temperature=WARM, acceleration=0.0, **changes):
    """The plant's outputs by name."""
    p = plant.p(oil_temperature=temperature, **changes)
    y = np.array(plant(x=z, u=[speed, load], slope=[acceleration, 0.0], p=p)["y"])[:, 0]
    return dict(zip(plant.outputs, y, strict=True))


def solved(unit, z0, speed, load, h=0.02, *, temperature=WARM, iterations=CONVERGED, **more):
    """A step whose speed does not change, as numbers."""
    p = parameters(unit, temperature)
    step = balance(unit).step(z0, speed, speed, 0.0, load, p, h, iterations=iterations, **more)
    return step, np.array(ca.DM(step.z))[:, 0]


def sizes(unit):
    """What a change of each state is small against."""
    kinds = {"position": 1e-3, "velocity": 1e-2, "opening": 1.0, "flow": 1e-4}
    return np.array([kinds.get(name.split("_")[0], 1e5) for name in balance(unit).states])


@cache
def stepper(unit, iterations):
    """A step whose speed does not change as a function of start, speed, load, parameters and time: for many of them."""
    found = balance(unit)
    z0, speed, load, h = ca.SX.sym("z0", len(found.states)), *(ca.SX.sym(name) for name in ("speed", "load", "h"))
    p = ca.SX.sym("p", ca.DM(parameters(unit)).numel())
    step = found.step(z0, speed, speed, 0.0, load, p, h, iterations=iterations)
    return ca.Function("step", [z0, speed, load, p, h], [ca.densify(step.z)])


def after(unit, z0, speed, load, h, iterations):
    """States after such a step."""
    p = ca.DM(parameters(unit))
    return np.array(stepper(unit, iterations)(z0, speed, load, p, h))[:, 0]


def moments(unit, seed=0, count=STATES):
    """States that a unit may be in, with a speed and a load: in a move under a load, and all pressures disturbed."""
    for z, speed, load in moments_of(unit, seed, count):
        yield z.copy(), speed, load


@cache
def moments_of(unit, seed, count):
    return tuple(found_moments(unit, seed, count))


def found_moments(unit, seed, count):
    rng = np.random.default_rng(seed)
    limits, found = limits_of(unit), balance(unit)
    for k in range(count):
        load = rng.uniform(0.1, 0.7) * limits.load
        z = found.at_rest(rng.uniform(0.1, 0.9) * unit.cylinder.stroke, load)
        speed = 0.0 if k % 4 == 3 else rng.uniform(-0.8, 0.8) * unit.max_speed
        for _ in range(3):
            z = after(unit, z, speed, load, 0.02, 10)
        pressures = [i for i, name in enumerate(found.states) if name.startswith("pressure")]
        z[pressures] *= rng.uniform(0.99, 1.01, len(pressures))
        yield z, (0.0 if k % 4 == 2 else speed * rng.uniform(0.7, 1.3)), load


def converged(unit, z0, speed, load, h=0.02, **more):
    """A step that does not change any more, or None: between two sides of a valve's edge it may swing."""
    step, z = solved(unit, z0, speed, load, h, **more)
    _, again = solved(unit, z0, speed, load, h, **more, iterations=CONVERGED + 1)
    return (step, z) if np.abs((z - again) / sizes(unit)).max() < 1e-9 else None


@pytest.fixture(params=CIRCUITS, scope="module")
def unit(request):
    return UNITS[request.param]


def test_a_step_that_has_converged_is_the_implicit_step_of_the_plant(unit, bare):
    plant, checked = bare(unit), 0
    assert balance(unit).states == plant.states
    for z0, speed, load in moments(unit):
        for h, temperature in ((0.005, WARM), (0.02, 290.0)):
            found = converged(unit, z0, speed, load, h, temperature=temperature)
            if found is None:
                continue
            step, z = found
            left = (z - z0 - h * mean_rate(plant, z0, z, speed, load, temperature)) / sizes(unit)
            assert np.abs(left).max() < 1e-6
            expected = look(plant, z, speed, load, temperature)["motor_torque"]
            assert float(step.torque) == pytest.approx(expected, rel=1e-9, abs=1e-9)
            checked += 1
    assert checked >= STATES // 3


def test_pressures_are_above_vacuum_and_where_relief_valves_cross_below_their_setting(unit):
    """Where both sides leak into each other alone, what they have in common has no way out but this."""
    found = with_friction(unit)
    crossing = unit.cylinder.area_a == unit.cylinder.area_b  # the double rod alone has such valves
    highest = 180e5 + unit.tank_pressure if crossing else 500e5
    pressures = [name.startswith("pressure_") for name in found.states]
    for asked, kept in ((500e5, highest), (-1e5, 0.0)):
        z = np.array(found.possible(ca.DM([asked] * len(pressures)))).ravel()
        assert list(z) == [kept if pressure else asked for pressure in pressures]


def test_the_torque_holds_what_speeds_the_rotor_up(unit, bare):
    z, speed, load = next(moments(unit))
    found = balance(unit)
    torque = float(found.torque(z, speed, 500.0, parameters(unit)))
    assert torque == pytest.approx(look(bare(unit), z, speed, load, acceleration=500.0)["motor_torque"], rel=1e-9)
    stepped = found.step(z, speed, speed, 500.0, load, parameters(unit), 0.02, iterations=CONVERGED)
    calm, _ = solved(unit, z, speed, load)
    assert float(stepped.torque) - float(calm.torque) == pytest.approx(500.0 * unit.drive.inertia, rel=1e-6)


def test_the_speed_of_the_step_moves_the_oil_and_the_speed_at_its_end_asks_for_the_torque(unit):
    z0, _, load = next(moments(unit))
    found, p = balance(unit), parameters(unit)
    mean, end = 100.0 * unit.lift_sign, 0.5 * unit.lift_sign  # where the friction of the pumps is not yet all there
    both = found.step(z0, mean, end, 0.0, load, p, 0.02, iterations=CONVERGED)
    _, z = solved(unit, z0, mean, load)
    assert np.array(ca.DM(both.z))[:, 0] == pytest.approx(z, rel=1e-9)
    assert float(both.torque) == pytest.approx(float(found.torque(z, end, 0.0, p)), rel=1e-9)


@pytest.mark.parametrize("lifts", [1.0, -1.0])
def test_three_iterations_a_step_follow_the_plant_through_a_move(unit, bare, lifts):
    """Ten milliseconds a step, a ramp and a constant speed, against an integrator that takes what it needs."""
    plant, load = bare(unit), 0.5 * limits_of(unit).load
    top, ramp, until, h = 0.4 * unit.max_speed * unit.lift_sign * lifts, 0.2, 0.6, 0.01

    def speed(t):
        return top * min(t / ramp, 1.0)

    z0 = balance(unit).at_rest(0.5 * unit.cylinder.stroke, load)
    exact = integrated(plant, speed, until, z0, load, rtol=1e-5, atol=1e-5 * sizes(unit))
    z = z0
    for k in range(round(until / h)):
        z = after(unit, z, 0.5 * (speed(k * h) + speed(k * h + h)), load, h, 3)
    travel = exact.y[0, -1] - z0[0]
    assert abs(travel) > 0.5 * abs(top) * (until - ramp) * unit.travel_per_radian
    assert z[0] - z0[0] == pytest.approx(travel, rel=5e-3)
    pressures = [i for i, name in enumerate(balance(unit).states) if name.startswith("pressure")]
    assert z[pressures] == pytest.approx(exact.y[pressures, -1], rel=0.03, abs=1e4)


def integrated(plant, speed, until, z0, load, **how):
    """The plant under a speed over time, by an integrator that takes what it needs."""
    p, by = plant.p(oil_temperature=WARM), jacobian_of(plant)

    def rates(t, z):
        return np.array(plant(z, [speed(t), load], 0.0, p)[0])[:, 0]

    jac = how | {"jac": lambda t, z: np.array(by(z, [speed(t), load], plant.p0))}
    return solve_ivp(rates, (0.0, until), z0, "Radau", **jac)


@cache
def jacobian_of(plant):
    x, u, p = ca.SX.sym("x", len(plant.states)), ca.SX.sym("u", 2), ca.SX.sym("p", plant.p0.size)
    by = ca.jacobian(plant(x=x, u=u, slope=0.0, p=p)["dx"], x)
    return ca.Function("jacobian", [x, u, p], [ca.densify(by)])


def linear_capacity(plant, z, change, node, **how):
    """A node's capacity, and how it changes along a change of the states."""
    there, back = (look(plant, z + sign * 1e-3 * change, **how)[f"capacity_{node}"] for sign in (1.0, -1.0))
    return look(plant, z, **how)[f"capacity_{node}"], (there - back) / 2e-3


def net(plant, z, node, **how):
    """Oil that a node gains from all its parts, less what its walls leave [m3/s]."""
    i = plant.states.index(f"pressure_{node}")
    return rate(plant, z, **how)[i] * look(plant, z, **how)[f"capacity_{node}"]


def kept_by_walls(plant, z0, z1, node, **how):
    """Share by which a node's capacity changes from one state to another, linearised at the first [1]."""
    capacity, change = linear_capacity(plant, z0, z1 - z0, node, **how)
    return change / capacity


def kept(plant, z0, z1, h, node, **how):
    """Oil that one iteration leaves in a node, by its linear equation [m3/s]."""
    capacity, change = linear_capacity(plant, z0, z1 - z0, node, **how)
    i = plant.states.index(f"pressure_{node}")
    return capacity * (z1[i] - z0[i]) / h + net(plant, z0, node, **how) * change / capacity


@pytest.mark.parametrize("name", CLOSED)
def test_an_iteration_makes_no_oil_in_a_closed_circuit(name, bare):
    unit, h = UNITS[name], 0.02
    plant, c = bare(unit), unit.cylinder
    nodes = [state.removeprefix("pressure_") for state in plant.states if state.startswith("pressure_")]
    for z0, speed, load in moments(unit):
        _, z1 = solved(unit, z0, speed, load, h, iterations=1)
        how = {"speed": speed, "load": load}
        gained = sum(kept(plant, z0, z1, h, node, **how) for node in nodes)
        given = -(c.area_a - c.area_b) * z1[1]
        flow = abs(speed) * unit.travel_per_radian * c.area(unit.held) + abs(c.area_a * z1[1])
        assert gained == pytest.approx(given, abs=1e-7 * flow)


@pytest.mark.parametrize("name", LOADER)
def test_an_iteration_passes_on_all_the_oil_that_a_pump_delivers(name, bare):
    """From the pump through manifold, valve and hose to the chamber, as long as no valve to the tank is open."""
    unit, h = UNITS[name], 0.02
    plant, c = bare(unit), unit.cylinder
    for z0, speed, load in moments(unit):
        _, z1 = solved(unit, z0, speed, load, h, iterations=1)
        how = {"speed": speed, "load": load}
        for side, sign in (("a", 1.0), ("b", -1.0)):
            if look(plant, z0, **how)[f"anticavitation_{side}.flow"] != 0.0:
                continue
            nodes = [f"{what}_{side}" for what in ("manifold", "line", "chamber")]
            gained = sum(kept(plant, z0, z1, h, node, **how) for node in nodes)
            delivered = sign * look(plant, z1, **how)[f"pump_{side}.flow"]
            # Of what leaks, half is that of the pressures before.
            leaks = [
                look(plant, z, **how, **tight(plant))[f"pump_{side}.flow"] - look(plant, z, **how)[f"pump_{side}.flow"]
                for z in (z0, z1)
            ]
            before = [kept_by_walls(plant, z0, z1, node, **how) for node in nodes[:1]]
            delivered += sign * 0.5 * (leaks[1] - leaks[0] * (1.0 + before[0]))
            grown = sign * c.area(side) * z1[1]
            assert gained == pytest.approx(delivered - grown, abs=1e-7 * max(abs(delivered), 1e-5))


@pytest.fixture
def differences(monkeypatch):
    """How a re-solved step follows a change, from both sides, while the slopes of its valves are kept.

    Those are kept for an iteration on purpose; a valve's own tangent would be another one.
    """

    def find(unit, z0, speed, load, change, step, factors=(1.0, 1.0, 1.0)):
        found = balance(unit)
        _, z = solved(unit, z0, speed, load, factors=factors)
        slopes = found._coefficients(z, speed, load, parameters(unit), ca.vertcat(*factors))
        monkeypatch.setattr(found, "_coefficients", lambda *_: slopes)
        ends = [solved(unit, **change(sign * step)) for sign in (1.0, -1.0)]
        (plus, after), (minus, before) = ends
        monkeypatch.undo()
        torque = sum(float(end.torque) * sign for end, sign in ((plus, 1.0), (minus, -1.0)))
        return (after - before) / (2.0 * step), torque / (2.0 * step)

    return find


@pytest.fixture(scope="module")
def smooth(unit):
    """The unit with hoses that stay laminar, because a step in their transition swings."""
    return unit.mapped(lambda part: replace(part, turbulent=False) if isinstance(part, Hose) else part)


def calm(unit):
    """A state in a steady move under a load, and at rest with the valves closed."""
    for z, speed, load in calm_of(unit):
        yield z.copy(), speed, load


@cache
def calm_of(unit):
    return tuple(found_calm(unit))


def found_calm(unit):
    load = 0.4 * limits_of(unit).load
    for speed in (0.4 * unit.max_speed * unit.lift_sign, -0.4 * unit.max_speed * unit.lift_sign, 0.0):
        z = balance(unit).at_rest(0.5 * unit.cylinder.stroke, load)
        for _ in range(60):
            z = after(unit, z, speed, load, 0.02, 3)
            z[0] = 0.5 * unit.cylinder.stroke
        yield z, speed, load


def assert_follows(found, expected, unit, rel=1e-2):
    """Whether two derivatives of the states are the same: each entry against the largest of its kind.

    Rounding leaves a little in a chamber that carries nothing.
    """
    kinds = [name.split("_")[0] for name in balance(unit).states]
    for kind in set(kinds):
        entries = [i for i, other in enumerate(kinds) if other == kind]
        assert np.abs(found - expected)[entries].max() <= rel * np.abs(expected)[entries].max() + 1e-30, kind


def test_the_step_follows_the_load_as_its_derivative_says(smooth, differences):
    for z0, speed, load in calm(smooth):
        step, _ = solved(smooth, z0, speed, load)
        found = np.array(ca.DM(step.by_load()))[:, 0]

        def other(by, z0=z0, speed=speed, load=load):
            return {"z0": z0, "speed": speed, "load": load + by}

        expected, torque = differences(smooth, z0, speed, load, other, 1e-4 * limits_of(smooth).load)
        assert_follows(found, expected, smooth)
        assert found[0] * smooth.lift_sign < 0.0
        assert float(step.torque_by(step.by_load())) == pytest.approx(torque, abs=1e-3 * smooth.travel_per_radian)


def test_the_step_follows_its_start_as_its_derivative_says(smooth, differences):
    rng = np.random.default_rng(4)
    for z0, speed, load in calm(smooth):
        step, _ = solved(smooth, z0, speed, load)
        direction = rng.uniform(-1.0, 1.0, z0.size) * sizes(smooth)
        along = 0.3 * limits_of(smooth).load
        found = np.array(ca.DM(step.by_start(direction, along)))[:, 0]

        def other(by, z0=z0, speed=speed, load=load, direction=direction, along=along):
            return {"z0": z0 + by * direction, "speed": speed, "load": load + by * along}

        expected, _ = differences(smooth, z0, speed, load, other, 1e-4)
        assert_follows(found, expected, smooth)


@pytest.mark.parametrize("k", range(len(FACTORS)), ids=FACTORS)
def test_the_step_follows_a_factor_as_its_derivative_says(smooth, k, differences):
    rng = np.random.default_rng(5)
    for z0, speed, load in calm(smooth):
        factors = [1.1, 0.99, 0.9]
        step, _ = solved(smooth, z0, speed, load, factors=factors)
        before, along = rng.uniform(-1.0, 1.0, z0.size) * sizes(smooth), 0.1 * limits_of(smooth).load
        found = np.array(ca.DM(step.by_factor(k, before, along)))[:, 0]

        def other(by, z0=z0, speed=speed, load=load, before=before, along=along, factors=factors):
            moved = [value + (by if i == k else 0.0) for i, value in enumerate(factors)]
            return {"z0": z0 + by * before, "speed": speed, "load": load + by * along, "factors": moved}

        expected, torque = differences(smooth, z0, speed, load, other, 1e-4)
        assert_follows(found, expected, smooth)
        shown = float(step.torque_by(step.by_factor(k, before, along))) + float(step.torque_by_factor(k))
        assert shown == pytest.approx(torque, rel=5e-3, abs=1e-3 * smooth.travel_per_radian * along)


@pytest.mark.parametrize("k", range(len(FACTORS)), ids=FACTORS)
def test_a_factor_alone_is_felt_by_the_position(smooth, k, differences):
    """Without a change of load or start beside it, so that nothing hides a wrong derivative."""
    for z0, speed, load in calm(smooth):
        step, _ = solved(smooth, z0, speed, load)
        found = float(step.by_factor(k, np.zeros(z0.size), 0.0)[0])

        def other(by, z0=z0, speed=speed, load=load):
            factors = [1.0 + (by if i == k else 0.0) for i in range(3)]
            return {"z0": z0, "speed": speed, "load": load, "factors": factors}

        expected, _ = differences(smooth, z0, speed, load, other, 1e-4)
        pumped = 0.02 * max(abs(speed), 20.0) * smooth.travel_per_radian
        assert found == pytest.approx(expected[0], rel=1e-3, abs=1e-6 * pumped)


def test_factors_are_those_of_a_machine_as_it_was_built(unit):
    leak, displacement, compliance = 1.3, 0.99, 1.25
    other = AsBuilt(leak=leak, displacement=displacement, stiffness=1.0 / compliance).apply(unit)
    for z0, speed, load in moments(unit):
        step, z = solved(unit, z0, speed, load, factors=(leak, displacement, compliance))
        same, expected = solved(other, z0, speed, load)
        assert z == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert float(step.torque) == pytest.approx(float(same.torque), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    "law", [lambda a, f: a + 3.0 * a * f, lambda a, f: a + a * f * f + f], ids=["linear", "square"]
)
def test_what_is_there_by_a_factor_only_is_the_rest_of_what_is_without_it(law):
    a, f = ca.SX.sym("a"), ca.SX.sym("f")
    share = ca.Function("share", [a, f], [_share_of(law(a, f), f)])
    assert float(share(2.0, 1.7)) == pytest.approx(law(2.0, 1.7) - law(2.0, 0.0), rel=1e-14)


def test_a_held_piston_stands_whatever_the_pump_does(unit):
    for z0, speed, load in moments(unit):
        z0[1] = 0.0
        _, z = solved(unit, z0, speed, load, held=1.0, iterations=2)
        assert z[0] == z0[0]
        z0[1] = 0.1
        _, z = solved(unit, z0, speed, load, held=1.0, iterations=2)
        assert abs(z[0] - z0[0]) < 2e-5
        _, free = solved(unit, z0, speed, load)
        assert free[0] != z0[0]


def test_at_rest_the_pressures_carry_the_load_and_a_step_changes_nothing(unit):
    found = balance(unit)
    for share in (0.1, 0.8):
        load = share * limits_of(unit).load
        z = found.at_rest(0.5 * unit.cylinder.stroke, load)
        assert float(found.force(z)) == pytest.approx(load, rel=1e-9)
    more = found.at_rest(0.5 * unit.cylinder.stroke, load + 1e3) - z
    assert found.rest_by_load() * 1e3 == pytest.approx(more, rel=1e-6)
    held = f"pressure_{unit.cylinder.node_a if unit.held == 'a' else unit.cylinder.node_b}"
    assert found.rest_by_load()[found.states.index(held)] > 0.0


def test_the_oil_of_a_balance_has_the_numbers_of_its_parameters(unit):
    found = balance(unit)
    values = dict(zip(found.parameters, found.values, strict=True))
    oil = found.oil_of(lambda name: values[name])
    assert float(oil.viscosity(300.0)) == pytest.approx(float(unit.oil.viscosity(300.0)))
    thicker = found.oil_of(lambda name: values[name] * (1.1 if name == "oil.walther_a" else 1.0))
    assert float(thicker.viscosity(300.0)) > 1.2 * float(unit.oil.viscosity(300.0))
    warmed = found.parameters_at(list(found.values), 333.0)
    assert float(warmed[found.parameters.index("oil_temperature")]) == 333.0


@dataclass(frozen=True)
class Drain:
    """A part that ramsight does not have: a line from a node to another that takes flow by the power of 3/4."""

    name: str
    inlet: str
    outlet: str
    size: float

    def connect(self, circuit):
        difference = circuit.pressure(self.inlet) - circuit.pressure(self.outlet)
        flow = self.size * difference / (difference**2 + 1e8) ** 0.125
        circuit.flow(self.name, self.inlet, self.outlet, flow)
        circuit.loss(self.name, flow * difference)


def spoilt(part):
    return tabulated(part, lambda value: 0.98 * value) if isinstance(part, Pump) else part


def with_part(unit, part):
    return replace(unit, extra=(*unit.extra, part))


def across(unit):
    """Nodes on either side of the pump that fills the side that holds the load."""
    nodes = side_nodes(unit, unit.held)
    pump = next(p for p in unit.parts() if isinstance(p, Pump) and (p.outlet in nodes) != (p.inlet in nodes))
    return (pump.outlet, pump.inlet) if pump.outlet in nodes else (pump.inlet, pump.outlet)


def each(kind, **changes):
    """A unit whose parts of this kind, or with this attribute, have other values; functions of the part are called."""

    def changed(part):
        if not (hasattr(part, kind) if isinstance(kind, str) else isinstance(part, kind)):
            return part
        return replace(part, **{key: value(part) if callable(value) else value for key, value in changes.items()})

    return lambda unit: unit.mapped(changed)


def airy(unit, air=0.01):
    return replace(unit, oil=replace(unit.oil, air=air, polytropic=1.4))


OPTIONS = {
    "a loss table": lambda unit: unit.mapped(spoilt),
    "leakage that grows like an orifice's": each(Pump, orifice_leak=2e-9),
    "viscosity under pressure": lambda unit: replace(unit, oil=replace(unit.oil, pressure_viscosity=1.8e-8)),
    "seals that leak": lambda unit: replace(unit, cylinder=replace(unit.cylinder, seal_leak=2e-18 * 32e-6 * 1e5)),
    "closed valves that leak": each("closed_leak", closed_leak=1e-18),
    "pilots that leak": each(ReliefValve, pilot_flow=2e-5, pilot_opens=0.2),
    "oil that pumps compress": each(Pump, compressed=0.02),
    "air that pumps draw": lambda unit: airy(each(Pump, compressed=0.02)(unit)),
    "belts that lose and creep": each(Pump, belt_loss=0.03, belt_creep=0.01),
    "pumps that starve": each(Pump, filling=lambda p: 0.4 * p.displacement * p.nominal_speed / math.sqrt(4e5)),
    "an orifice across the pump": lambda unit: with_part(unit, Orifice("short", *across(unit), 2e-9)),
    "a part of one's own": lambda unit: with_part(unit, Drain("drain", *across(unit), 2e-11)),
}


#: a pump that lowers draws from under the load
WITHOUT_EFFECT = {("pumps that starve", -1.0)}


def steady(unit, plant, speed, load, guess):
    """States of the plant at which nothing but the position changes."""
    middle, scale = guess[0], sizes(unit)[1:]
    rates = 1.0 / np.array([1e3 if name == "velocity" else 1e8 for name in plant.states[1:]])

    def left(y):
        return rate(plant, np.array([middle, *(y * scale)]), speed, load)[1:] * rates

    found = root(left, guess[1:] / scale, tol=1e-13)
    assert np.abs(found.fun).max() < 1e-7
    return np.array([middle, *(found.x * scale)])


@pytest.mark.parametrize("name", ["mining-loader boom", "press ram"])
@pytest.mark.parametrize("option", OPTIONS)
def test_an_option_of_a_part_changes_the_balance_as_it_changes_the_plant(name, option, bare):
    unit = UNITS[name]
    changed = OPTIONS[option](unit)
    plant, load = bare(changed), 0.4 * limits_of(unit).load
    for direction in (1.0, -1.0):
        speed = 0.3 * unit.max_speed * unit.lift_sign * direction
        velocities = []
        for which in (unit, changed):
            z = balance(which).at_rest(0.5 * which.cylinder.stroke, load)
            for k in range(80):
                z = after(which, z, speed, load, 0.02 if k < 50 else 1.0, 3)
                z[0] = 0.5 * which.cylinder.stroke
            velocities.append(z[1])
        exact = steady(changed, plant, speed, load, z)
        assert z[1] == pytest.approx(exact[1], rel=1e-6)
        if (option, direction) not in WITHOUT_EFFECT:
            assert abs(velocities[1] / velocities[0] - 1.0) > 1e-4, "the option has no effect here"
        turning = float(balance(changed).torque(z, speed, 0.0, parameters(changed)))
        assert turning == pytest.approx(look(plant, exact, speed, load)["motor_torque"], rel=1e-6)


def test_free_air_makes_the_oil_give_way_as_it_does_in_the_plant(unit, bare):
    with_air, checked = airy(unit, 0.005), 0
    plant = bare(with_air)
    for z0, speed, load in moments(unit, seed=8):
        found = converged(with_air, z0, speed, load)
        if found is None:
            continue
        _, z = found
        assert np.abs((z - z0 - 0.02 * mean_rate(plant, z0, z, speed, load)) / sizes(unit)).max() < 1e-6
        _, without = solved(unit, z0, speed, load)
        assert np.abs((z - without) / sizes(unit)).max() > 1e-6
        checked += 1
    assert checked >= 1


@pytest.mark.parametrize("lifts", [1.0, -1.0])
@pytest.mark.parametrize("name", UNITS)
def test_a_steady_move_is_steady_in_the_balance(name, lifts):
    unit = UNITS[name]
    load, speed = 0.5 * limits_of(unit).load, 0.4 * lifts * unit.max_speed * unit.lift_sign
    z, torques = balance(unit).at_rest(0.5 * unit.cylinder.stroke, load), []
    for _ in range(60):
        step, z = solved(unit, z, speed, load, iterations=3)
        z[0] = 0.5 * unit.cylinder.stroke
        torques.append(float(step.torque))
    assert np.ptp(torques[-10:]) < 1e-3 * limits_of(unit).torque


def test_every_unit_lifts_when_its_pump_fills_the_side_that_holds_the_load(unit):
    load = 0.4 * limits_of(unit).load
    speed = 0.3 * unit.max_speed * unit.lift_sign
    assert pumped_into(unit, unit.held) * unit.lift_sign > 0.0
    z = balance(unit).at_rest(0.5 * unit.cylinder.stroke, load)
    for _ in range(20):
        _, z = solved(unit, z, speed, load, iterations=2)
    assert (z[0] - 0.5 * unit.cylinder.stroke) * unit.lift_sign > 0.0


def held_up(unit, load=0.3):
    """The balance with friction, its parameters, and a load that it carries at rest in mid-stroke."""
    found, force = with_friction(unit), load * limits_of(unit).load
    return found, found.parameters_at(list(found.values), WARM), force, found.at_rest(0.5 * unit.cylinder.stroke, force)


def sliding(unit, lifts, load=0.3):
    """States and load of a steady move, friction in it."""
    found, p, force, z = held_up(unit, load)
    turns = lifts * unit.lift_sign * np.sign(unit.travel_per_radian) * 60.0
    for _ in range(40):
        z[0] = 0.5 * unit.cylinder.stroke
        z = np.array(ca.DM(found.step(z, turns, turns, 0.0, force, p, 0.02, iterations=4).z))[:, 0]
    return found, z, turns, force, p


@pytest.mark.parametrize("lifts", [1.0, -1.0])
@pytest.mark.parametrize("name", UNITS)
def test_a_piston_that_slides_is_held_back_by_its_friction(name, lifts):
    unit = UNITS[name]
    found, z, *_, force, _ = sliding(unit, lifts)
    velocity = z[found.states.index("velocity")]
    assert abs(velocity) > 1e-3
    beyond_breakaway = np.copysign(max(abs(velocity), 5.0 * unit.cylinder.stribeck_velocity), velocity)
    friction = unit.lift_sign * float(unit.cylinder.friction(beyond_breakaway))
    assert float(found.force(z)) - force == pytest.approx(friction, abs=0.02 * abs(friction) + 1.0)


@pytest.mark.parametrize("name", UNITS)
def test_a_solution_that_has_settled_is_the_one_that_further_iterations_find(name):
    unit, limits = UNITS[name], limits_of(UNITS[name])
    found, z, turns, force, p = sliding(unit, 1.0)
    close, random, settled = 1e-4 * limits.torque, np.random.default_rng(0), []
    for _ in range(60):
        speed = turns * random.choice([1.0, random.uniform(-1.5, 1.5)])
        load = force + random.choice([0.0, random.uniform(-0.3, 0.3) * limits.load])
        first = found.step(z, speed, speed, 0.0, load, p, 0.02)
        further = found.step(z, speed, speed, 0.0, load, p, 0.02, guess=first.z, iterations=4)
        settled.append(bool(first.settled(close)))
        if settled[-1]:
            assert float(further.torque) == pytest.approx(float(first.torque), abs=2.0 * close)
    assert 0.1 < np.mean(settled) < 1.0, "there are both"


@pytest.mark.parametrize("name", UNITS)
def test_a_piston_that_friction_lets_go_in_the_next_iteration_has_not_settled(name):
    unit, random, turned = UNITS[name], np.random.default_rng(0), []
    found, p, force, z = held_up(unit)
    for _ in range(40):
        ways, shares = random.choice([-1.0, 1.0], 2), 10.0 ** random.uniform(-4.0, 0.0, 2)
        speed, load = ways[0] * shares[0] * unit.max_speed, force * (1.0 + 0.1 * ways[1] * shares[1])
        one, two = (found.step(z, speed, speed, 0.0, load, p, 0.02, iterations=k) for k in (1, 2))
        turned.append(bool(one.stands) != bool(two.stands))
        assert bool(one.settled(1e12)) == (not turned[-1])
        held = found.step(z, speed, speed, 0.0, load, p, 0.02, held=1.0, iterations=1)
        assert bool(held.settled(1e12)), "where it is held friction decides nothing"
    assert not all(turned)
    assert any(turned) or name == "forklift-mast lift", (
        "a check valve keeps the pump's oil from the mast that friction holds"
    )


@pytest.mark.parametrize("name", UNITS)
def test_a_load_that_friction_holds_moves_nothing(name):
    unit = UNITS[name]
    found, p, force, z = held_up(unit)
    coulomb = unit.cylinder.coulomb_friction
    moved = {}
    for share in (0.8, -0.8, 3.0, -3.0):
        load, factors = force + share * coulomb, (1e-6, 1.0, 1.0)  # leakage lets a load sink that the pump holds
        step = found.step(z, 0.0, 0.0, 0.0, load, p, 0.02, factors=factors, iterations=10)
        moved[share] = float(np.array(ca.DM(step.z))[0, 0] - z[0]) * unit.lift_sign
    assert abs(moved[0.8]) < 1e-9
    assert abs(moved[-0.8]) < 1e-9
    assert moved[3.0] < 0.0 < moved[-3.0]


@pytest.mark.parametrize("name", UNITS)
def test_a_change_that_friction_cannot_hold_has_a_slope_of_its_own(name):
    unit = UNITS[name]
    found, p, force, z = held_up(unit)
    tight = {"factors": (1e-6, 1.0, 1.0), "iterations": 4}
    step = found.step(z, 0.0, 0.0, 0.0, force, p, 0.02, **tight)
    assert abs(float(ca.DM(step.by_load()[0]))) < 1e-12
    free = balance(unit).step(z, 0.0, 0.0, 0.0, force, parameters(without_friction(unit)), 0.02, **tight)
    large, freely = float(ca.DM(step.by_large_load()[0])), float(ca.DM(free.by_load()[0]))
    assert large == pytest.approx(freely, rel=0.02)


@pytest.mark.parametrize("name", ["eha-test-bench axis", "eha-single-rod axis"])
def test_a_load_that_has_settled_moves_the_piston_by_leakage_alone(name):
    """Two loads, each until its pressures have settled; then a step of each, the motor standing."""
    unit, h = UNITS[name], 0.02
    found, p, load, _ = held_up(unit)

    def sinks(load):
        z = found.at_rest(0.5 * unit.cylinder.stroke, load)
        for _ in range(100):
            z = ca.DM(found.step(z, 0.0, 0.0, 0.0, load, p, h, iterations=8).z)
            z[0] = 0.5 * unit.cylinder.stroke
        step = found.step(z, 0.0, 0.0, 0.0, load, p, h, iterations=8)
        return float(step.z[0]) - 0.5 * unit.cylinder.stroke, step

    more = 0.01 * load
    here, step = sinks(load)
    slope = (sinks(load + more)[0] - sinks(load - more)[0]) / (2.0 * more)
    assert here * unit.lift_sign < 0.0, "the pump alone holds it, and leaks"
    assert float(step.by_settled_load()[0]) == pytest.approx(slope, rel=0.05)
    assert abs(slope) < 0.2 * abs(float(step.by_large_load()[0])), "what the oil gives way is more"


@pytest.mark.parametrize("name", LOADER)
def test_a_pump_that_builds_up_pressure_leaks_as_in_the_plant_at_a_drives_sampling(name, bare):
    """A lift from an empty manifold in steps of 20 ms: leakage by the pressures after each loses half a step of it."""
    unit, h, until = UNITS[name], 0.02, 0.5
    plant, found, load = bare(unit), balance(unit), 0.7 * limits_of(unit).load
    z0 = found.at_rest(0.5 * unit.cylinder.stroke, load)
    z0[found.states.index(f"pressure_manifold_{unit.held}")] = unit.tank_pressure

    def speed(t):
        return 200.0 * t * unit.lift_sign

    exact = integrated(plant, speed, until, z0, load, max_step=2e-3, rtol=1e-7, atol=1e-6 * sizes(unit))
    z, p = z0, parameters(unit)
    for k in range(round(until / h)):
        mean = speed((k + 0.5) * h)
        z = np.array(ca.DM(found.step(z, mean, mean, 0.0, load, p, h, iterations=8).z))[:, 0]
    velocity = unit.travel_per_radian * speed(until)
    assert abs(z[1] - exact.y[1, -1]) < 0.02 * abs(velocity)
    leak_velocity = abs(velocity) - abs(exact.y[1, -1])
    assert abs(z[0] - exact.y[0, -1]) < 0.15 * h * leak_velocity


def test_iterations_go_on_where_a_valve_was_taken_to_be_open():
    """From a guess with oil drawn from the tank, while the load presses it: two iterations end far away."""
    unit = UNITS["mining-loader bucket"]
    found = with_friction(unit)
    p = found.parameters_at(list(found.values), 318.15)
    names = ("chamber_a", "chamber_b", "manifold_a", "line_a", "manifold_b", "line_b")
    assert found.states == ("position", "velocity", *(f"pressure_{name}" for name in names))
    z0 = np.array([0.5, -0.009, 160.69e5, 6.75e5, 160.60e5, 160.69e5, 6.76e5, 6.75e5])
    guess = np.array([0.5003, 0.0093, 137.27e5, 4.07e5, 137.11e5, 137.26e5, 4.04e5, 4.07e5])

    def from_guess(**how):
        step = found.step(z0, -38.5, -47.4, 0.0, -207.9e3, p, 0.05, guess=guess, **how)
        return np.array(ca.DM(step.z))[:, 0] / sizes(unit)

    end = from_guess(iterations=CONVERGED)
    assert np.abs(from_guess(iterations=2) - end).max() > 10.0
    assert np.abs(from_guess(iterations=2, more=3) - end).max() < 2.0
    assert np.abs(from_guess(iterations=2, more=6) - end).max() < 0.2
