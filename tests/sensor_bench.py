"""A bench for pieces of a sensor: a graph around one piece, stepped sample by sample without being compiled."""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ramsight.duty import DriveReport, Duty, Profile, lift_lower, report, simulate
from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import constant
from ramsight.plant.balance import FACTORS, balance
from ramsight.plant.limits import limits_of
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.contact import Believed, ContactWatch
from ramsight.sensor.load import LoadObserver
from ramsight.sensor.virtual_sensor import SensorGraph, log_inputs

from .plant_bench import UNITS

WARM = 313.15


@dataclass
class Stepped:
    """A sensor that is stepped by CasADi's own machine: a graph is ready at once, and a sample takes 0.1 ms.

    Args:
        sensor: whose graph it is.
    """

    sensor: object

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


def believed_of(position, stroke, *, std=1e-3, relief=0.0, compliance=0.0, unseen=1e9, stiffness=1e8, held_back=0.0):
    """What is believed of a piston whose position is known, for a watch over contacts."""
    return Believed(
        position=position,
        stroke=stroke,
        std=std,
        known=1.0,
        relief=relief,
        held_back=held_back,
        compliance=compliance,
        unseen=unseen,
        stiffness=stiffness,
    )


def load_observer(unit, factors=None, *, watches=False, assumptions=None, std=2e-3, compliance=0.0):
    """The load observer of a unit, perhaps with a watch for contacts, and nothing else around it."""
    graph, limits, circuit = SensorGraph(), limits_of(unit), balance(unit)
    graph.initially("position", 0.5 * unit.cylinder.stroke)
    graph.parameters.add("travel_per_radian", float(unit.travel_per_radian))
    stroke = graph.parameters.add("stroke", float(unit.cylinder.stroke))
    observer = LoadObserver(graph, circuit, limits, assumptions or Assumptions())
    factors_of = factors or [1.0] * len(FACTORS)
    more, came = {}, 0.0
    if watches:
        watch = ContactWatch(graph, float(unit.lift_sign), unit.assumptions.stops)
        step = observer.step(factors_of, watch.held)
        position, unseen = graph.position + step.travel, unit.assumptions.machine.unseen_load * limits.load
        believed = believed_of(position, stroke, std=ca.SX(std), compliance=compliance, unseen=unseen, stiffness=1e12)
        contact = watch.look(step, believed)
        watch.close(contact, position, 0.0)
        came = observer.release(contact.released, contact.held, contact.shown, step.give)
        names = ("touched", "anew", "place", "at_top", "held", "released", "stands", "pushing", "built")
        more |= {name: (getattr(contact, name), "1") for name in names}
    else:
        step = observer.step(factors_of, 0.0)
    graph.becomes("position", graph.position + step.travel + came)
    names = ("travel", "free_travel", "surprise", "change", "noise", "noise_travel", "give", "seen", "carried", "empty")
    more |= {name: (getattr(step, name), "1") for name in names}
    more |= {f"travel_by_{name}": (by, "1") for name, by in zip(FACTORS, step.travel_by, strict=True)}
    more |= {f"torque_by_{name}": (by, "1") for name, by in zip(FACTORS, step.torque_by, strict=True)}
    more |= {
        "friction": (step.friction, "1"),
        "asked": (step.asked, "1"),
        "torque": (step.torque, "1"),
        "step_load": (step.load, "1"),
        "may_be_empty": (ca.SX(step.may_be_empty), "1"),
    }
    sensor = graph.sensor(
        "observer",
        position=graph.position + step.travel + came,
        velocity=step.velocity,
        load=step.load,
        std=step.noise_travel,
        status=0.0,
        more=more,
    )
    return Stepped(sensor)


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
