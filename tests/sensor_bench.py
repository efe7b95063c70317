"""A bench for pieces of a sensor: a graph around one piece, stepped sample by sample without being compiled."""

from dataclasses import dataclass, field, fields, replace
from functools import lru_cache

import casadi as ca
import numpy as np

from ramsight.duty import DriveReport, Duty, Profile, lift_lower, report, simulate
from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import constant
from ramsight.engine.typed_state import leaf, symbols
from ramsight.plant.balance import FACTORS
from ramsight.plant.balance import balance as balance_of
from ramsight.plant.limits import limits_of
from ramsight.plant.symbols import Parameters
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.circuit.load import LoadState, Piston, observe_load
from ramsight.sensor.circuit.load_release import Release, UnheldState, release_load
from ramsight.sensor.circuit.load_step import LoadEstimate, LoadStep, Motion, TorqueStep
from ramsight.sensor.circuit.relief import relief_probability, relief_tolerance
from ramsight.sensor.contacts.contact import look_for_contact
from ramsight.sensor.contacts.contact_state import ContactState, Estimated, moved
from ramsight.sensor.inputs.oil_heat import WarmingState, warming_rate
from ramsight.sensor.inputs.sample import Raw, SampleState, plain_sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.virtual_sensor import Report, close, log_inputs

from .plant_bench import UNITS

WARM = 313.15


@dataclass
class Stepped:
    """A sensor that is stepped by CasADi's own machine: a graph is ready at once, and a sample takes 0.1 ms."""

    sensor: object  # whose graph it is

    def __post_init__(self):
        step = self.sensor.recursion.function()
        arguments = step.sx_in()
        self._function = ca.Function("step", arguments, [ca.densify(result) for result in step(*arguments)])
        self.state = self.sensor.initial.copy()

    def track(self, log):
        """Go on through a log; every output of the sensor over its samples, and every state as `state_<name>`."""
        count = log.sizes["time"]
        inputs = log_inputs(self.sensor, log)
        recursion = self.sensor.recursion
        states, out = np.empty((count, self.state.size)), np.empty((count, len(recursion.outputs)))
        buffer, run = self._function.buffer()
        sample, before, after = np.empty(inputs.shape[1]), self.state.copy(), np.empty(self.state.size)
        values, result = self.sensor.parameters.copy(), np.empty(out.shape[1])
        for k, array in enumerate((before, sample, values)):
            buffer.set_arg(k, memoryview(array))
        for k, array in enumerate((after, result)):
            buffer.set_res(k, memoryview(array))
        for i in range(count):
            sample[:] = inputs[i]
            run()
            states[i], out[i] = after, result
            before[:] = after
        self.state = before.copy()
        named = dict(zip(recursion.outputs, out.T, strict=True))
        return named | {f"state_{name}": column for name, column in zip(recursion.state, states.T, strict=True)}

    def start(self, position=None, std=1e-3):
        """As the sensor's own."""
        self.sensor.start(position, std)
        self.state = np.array([self.sensor.state[name] for name in self.sensor.recursion.state])


@dataclass(frozen=True, kw_only=True)
class Fed:
    """The state of a piece alone: inputs that are set by hand, and the piece's own."""

    position: object = leaf("m", 0.3)
    intake: object
    inputs: object
    piece: object


def fed(names, initial, write):
    """A sensor of one piece: `write(state, sample, inputs)` gives its state and values; inputs are set by hand."""
    raw = Raw.symbols()
    first = Fed(intake=SampleState.initial(), inputs=dict.fromkeys(names, ca.SX(0.0)), piece=initial)
    state = symbols(first)
    intake, sample = plain_sample(state.intake, raw)
    piece, found = write(state.piece, sample, state.inputs)
    after = replace(state, intake=intake, piece=piece)
    values = found if isinstance(found, dict) else {"value": found}
    more = {name: (ca.SX(1.0) * value, "1") for name, value in values.items()}
    said = Report(ca.SX(0.0), 0.0, 0.0, 0.0, ca.SX(0.0), more)
    return Stepped(close("piece", Parameters(), raw, first, state, after, said))


@dataclass
class Machine:
    """What a stage asks of a machine model, in round numbers: a tenth of a millimetre per radian, 500 N of friction."""

    lift: float = 1.0
    stroke: float = 0.7
    travel_per_radian: float = 1e-4
    torque_std: float = 0.5
    stop_stiffness: float = 1e8
    passive: bool = False
    leak_velocity: float = 0.0
    assumed: object = field(default_factory=Assumptions)
    balance: object = field(default_factory=lambda: balance_of(UNITS["mining-loader boom"]))

    def thinner(self, temperature):
        return 1.0

    def of_circuit(self, name):
        return {"cylinder.coulomb_friction": 500.0}[name]


def made(kind, **values):
    """An instance of a dataclass of expressions, 0 where nothing else is set."""
    return kind(**({one.name: ca.SX(0.0) for one in fields(kind)} | values))


def step_of(x=None, **values):
    """A load step of which everything is 0 that is not set: by the names of its parts' fields."""
    known = {**(x or {}), **values}

    def part(kind):
        return made(kind, **{one.name: ca.SX(1.0) * known[one.name] for one in fields(kind) if one.name in known})

    parts = {"motion": part(Motion), "torque": part(TorqueStep), "load": part(LoadEstimate)}
    return LoadStep(**parts, z=None, travel_by=(), torque_by=(), over_pressures=None, pump_heat=None)


def estimated(position, *, std=1e-3, relief=0.0, compliance=0.0, unseen=1e9, tolerance=0.0):
    """What is estimated of a piston whose position is known, for a stage that looks for contacts."""
    return Estimated(
        position=position,
        std=std,
        known=ca.SX(1.0),
        relief=ca.SX(1.0) * relief,
        relief_tolerance=tolerance,
        compliance=ca.SX(1.0),
        compliance_std=ca.SX(1.0) * compliance,
        load_change_std=unseen,
    )


@dataclass(frozen=True, kw_only=True)
class Observed:
    """The state of a load observer, perhaps with a watch for contacts."""

    position: object = leaf("m", None)
    intake: object
    load: object
    warming: object
    unheld: object
    contact: object


def load_observer(unit, factors=None, *, watches=False, assumptions=None, std=2e-3, compliance=0.0):
    """The load observer of a unit, perhaps with a watch for contacts, and nothing else around it."""
    model = replace(MachineModel.of(unit, assumptions or Assumptions()), stop_stiffness=ca.SX(1e12))
    raw, load = Raw.symbols(), LoadState.initial(model)
    first = Observed(
        position=ca.SX(0.5 * unit.cylinder.stroke),
        intake=SampleState.initial(),
        load=load,
        warming=WarmingState(),
        unheld=UnheldState.initial(load),
        contact=ContactState() if watches else None,
    )
    state = symbols(first)
    intake, sample = plain_sample(state.intake, raw)
    warming, rate = warming_rate(state.warming, sample)
    factors_of, more, came = factors or [1.0] * len(FACTORS), {}, 0.0
    piston = Piston(state.position, state.contact.held, ca.SX(0.0)) if watches else Piston.free(state.position)
    load, step = observe_load(state.load, sample, piston, factors_of, rate, model)
    unheld, contact_state = state.unheld, None
    position = state.position + step.motion.travel
    if watches:
        unseen = unit.assumptions.machine.unseen_load * model.relief_load
        relief = relief_probability(step.z, sample.extending_speed, model)
        tolerance = relief_tolerance(relief, model.assumed.machine.relief)
        now = estimated(
            position, std=ca.SX(std), compliance=compliance, unseen=unseen, relief=relief, tolerance=tolerance
        )
        contact_state, contact = look_for_contact(state.contact, sample, step, now, model)
        contact_state = moved(contact_state, contact, position, ca.SX(0.0))
        hold, place = contact.hold, contact.place
        before = ca.fmin(ca.fmax(state.position, 0.0), float(unit.cylinder.stroke))
        release = Release(hold.released, hold.held, hold.shown)
        unheld, load, came = release_load(state.unheld, load, before, release, step.motion.give, model)
        more |= {"found": place.found, "evidence": place.evidence, "place": place.position, "at_top": place.at_top}
        more |= {name: getattr(hold, name) for name in ("held", "released", "stands", "pushing", "went")}
    after = Observed(
        position=position + came, intake=intake, load=load, warming=warming, unheld=unheld, contact=contact_state
    )
    more |= {f"travel_by_{name}": by for name, by in zip(FACTORS, step.travel_by, strict=True)}
    more |= {f"torque_by_{name}": by for name, by in zip(FACTORS, step.torque_by, strict=True)}
    for part in (step.motion, step.torque, step.load):
        of = {"value": "step_load", "noise": "noise_travel" if part is step.motion else "noise"}
        more |= {of.get(one.name, one.name): getattr(part, one.name) for one in fields(part) if one.name != "velocity"}
    outputs = {name: (ca.SX(1.0) * value, "1") for name, value in more.items()}
    said = Report(after.position, step.motion.noise, step.motion.velocity, step.load.value, ca.SX(0.0), outputs)
    return Stepped(close("observer", model.table, raw, first, state, after, said))


@lru_cache
def observers(name, watches=False):
    """The observer of a unit of the catalogue, made once; begin it with `start`."""
    return load_observer(UNITS[name], watches=watches)


def begin(stepped, position):
    """Forget everything; the piston is here [m]."""
    stepped.state = stepped.sensor.initial.copy()
    stepped.state[stepped.sensor.recursion.state.index("position")] = position


def quiet(unit, seed=0, share=0.002):
    """What a drive with a small noise reports: this share of the torque at relief pressure."""
    torque = limits_of(unit).torque
    return DriveReport(
        speed_step=0.01, torque_step=share * torque, torque_noise=share * torque, temperature_noise=0.05, seed=seed
    )


@lru_cache
def cycle(unit, share=0.4):
    """One lift-lower cycle under this share of the load at relief pressure: the run and its log.

    No faster than that a second at constant speed stays within 45 % of the stroke.
    """
    load = share * limits_of(unit).load
    speed = min(SPEED, 0.45 * unit.cylinder.stroke / (1.8 * unit.travel_per_radian))
    start = lowered(unit, 0.4 * unit.cylinder.stroke)  # a pump that holds a load by itself lets it sink
    run = simulate(unit, lift_lower(unit, load, WARM, motor_speed=speed, start_position=start))
    return run, report(run, quiet(unit))


def moves(unit, corners, load, start):
    """A run through speeds (time, share of the highest speed that lifts) under a load over time."""
    time, shares = zip(*corners, strict=True)
    speed = Profile(time, [unit.max_speed * unit.lift_sign * share for share in shares])
    profile = load if isinstance(load, Profile) else constant(load)
    run = simulate(unit, Duty(speed, profile, constant(WARM), start))
    return run, report(run, quiet(unit))


def changing(corners):
    """A quantity that runs from corner to corner (time, value)."""
    return Profile(*zip(*corners, strict=True))


def lowered(unit, height):
    """Position [m] at a height above the lowered end."""
    return height if unit.lift_sign > 0.0 else unit.cylinder.stroke - height
