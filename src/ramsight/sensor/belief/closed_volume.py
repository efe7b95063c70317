"""What every stop and every start of the motor shows of the machine: the oil between the pump and a closed valve.

Behind a closed valve a volume is shut in. Its pressure rises by the angle that the motor turns and sinks by leakage,

    d tau/dt = (w - k tau)/c        c compliance [rad/(N m)], k leakage [rad/s/(N m)]

so the decay after a stop tells leakage over compliance, and the rise of a start both together. The circuit's balance
has that equation. Here its innovations are summed over an event as a least-squares problem of leakage and compliance,
and of what an event may be wrong by: gain, offset and delay of the torque, and the law of leakage. At the end of the
event these are eliminated; what is left is a measurement of leakage and compliance together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, negated, scalar
from ramsight.sensor.belief.measurement import Measurement
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.inputs.sample import Sample, lasted
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import Quantity, Row, Values
from ramsight.sensor.thresholds import (
    EFFICIENCY_STD,
    EVENT_COUNTS,
    EVENT_GAIN_STANDING,
    EVENT_MODEL_STD,
    EVENT_MOVING_STD,
    EVENT_SAMPLING,
    EVENT_STANDING_STD,
    GAP_PERIOD,
    HALF,
    LIKELY_STDS,
    MOTOR_TURNS,
    NOISE_AVERAGED,
    SHORTEST_STEP,
    STOOD_STILL,
    SURE_STDS,
    TINY,
    TORQUE_OFFSET,
)

EVENT_QUANTITIES = (Quantity.LEAKAGE, Quantity.COMPLIANCE)
"""What an event shows."""
SHARED = (Quantity.RELEASE,)
"""What it may be wrong by as all others are: a drive that releases its torque at standstill."""
_NUISANCES = (Quantity.EXPONENT, "gain", "offset", "delay")
_NAMES: tuple[str, ...] = (*EVENT_QUANTITIES, *_NUISANCES)
_INNOVATION = "innovation"
_PAIRS = tuple((i, j) for k, i in enumerate(_NAMES) for j in _NAMES[k:])


@dataclass(frozen=True, kw_only=True)
class EventState:
    """A stop or a start against a closed valve that goes on."""

    active: Flag = leaf("1")  # whether one does
    stands: Flag = leaf("1")  # whether the motor stands in it
    stood: Scalar = leaf("s")  # how long the motor has stood [s]
    torque: Scalar = leaf("N m")  # at the last sample [N m]
    offset: Scalar = leaf("N m")  # of the torque at the last standstill, as the other side's pressure makes it [N m]
    # last: derivatives and innovation of the last sample, over the standard deviation, until the next one shows that
    # the valve was still closed
    last: Mapping[str, Scalar] = leaf("1", None)
    normal: Mapping[str, Scalar] = leaf("1", None)  # sums of products of derivatives over the variance, by pair
    right: Mapping[str, Scalar] = leaf("1", None)  # sums of products with the innovation

    @classmethod
    def initial(cls) -> EventState:
        """Before the first sample."""
        pairs = {f"{i},{j}": scalar(0.0) for i, j in _PAIRS}
        return cls(
            last=dict.fromkeys((*_NAMES, _INNOVATION), scalar(0.0)),
            normal=pairs,
            right=dict.fromkeys(_NAMES, scalar(0.0)),
        )


def follow_event(
    state: EventState,
    sample: Sample,
    step: LoadStep,
    torque_by: Row,
    closed: Flag,
    point: Values,
    model: MachineModel,
) -> tuple[EventState, Measurement]:
    """One sample of an event, and what the event before it shows if that has ended.

    Args:
        torque_by: derivatives of the torque with respect to what the step was made with.
        closed: whether a valve may keep the load from the pump, and nothing else is wrong.
    """
    noise = model.torque_std
    # Slower, friction has either sign, as at standstill.
    stands = ca.fabs(sample.motor_speed) < MOTOR_TURNS
    felt = any_of(*(ca.fabs(torque_by[one]) > noise for one in EVENT_QUANTITIES))
    # Where the valve opens, the piston takes the oil and the torque stays behind.
    change = sample.motor_torque - state.torque
    behind = ca.fabs(change - step.torque.change)
    follows = behind < HALF * ca.fabs(step.torque.change) + SURE_STDS * noise
    stood = ca.if_else(stands, state.stood + sample.elapsed, 0.0)
    # A start that does not begin at a standstill finds the valve open and the manifold full.
    from_rest = any_of(stands, lasted(state.stood, STOOD_STILL), all_of(state.active, negated(state.stands)))
    active = all_of(closed, from_rest, step.torque.shows < HALF, felt, sample.elapsed > 0.0)
    same = all_of(active, state.active, follows, stands == state.stands)
    event = _event(state, all_of(state.active, negated(same)), sample.elapsed, point)
    deviation = ca.sqrt(noise**2 + (EVENT_MODEL_STD * step.torque.expected) ** 2)
    settling = sample.elapsed / (NOISE_AVERAGED + sample.elapsed)
    offset = state.offset + ca.if_else(stands, settling * (step.torque.missed - state.offset), 0.0)
    row = {**_row(sample, step, torque_by, stands, offset, model), _INNOVATION: step.torque.missed}
    kept, last = chosen(same, state, EventState.initial()), state.last
    added = EventState(
        active=active,
        stands=stands,
        stood=stood,
        torque=sample.motor_torque,
        offset=offset,
        last={one: ca.if_else(active, value / deviation, 0.0) for one, value in row.items()},
        normal={f"{i},{j}": kept.normal[f"{i},{j}"] + ca.if_else(same, last[i] * last[j], 0.0) for i, j in _PAIRS},
        right={i: value + ca.if_else(same, last[i] * last[_INNOVATION], 0.0) for i, value in kept.right.items()},
    )
    return added, event


def _row(
    sample: Sample, step: LoadStep, torque_by: Row, stands: Flag, offset: Scalar, model: MachineModel
) -> dict[str, Real]:
    """Derivatives of the torque; those of nuisances by their own standard deviations."""
    torque, assumed = step.torque, model.assumed
    rate = torque.change / ca.fmax(sample.elapsed, SHORTEST_STEP)
    return {
        **{one: torque_by[one] for one in EVENT_QUANTITIES},
        Quantity.EXPONENT: assumed.machine.leak_exponent * torque_by[Quantity.EXPONENT],
        "gain": ca.if_else(stands, EVENT_GAIN_STANDING, EFFICIENCY_STD) * torque.expected,
        "offset": TORQUE_OFFSET * model.relief_torque
        + assumed.drive.standing
        + ca.if_else(stands, 0.0, ca.fabs(offset)),
        "delay": ca.sqrt(assumed.drive.delay**2 + sample.elapsed**2) * rate,
    }


def _event(state: EventState, ends: Flag, elapsed: Scalar, point: Values) -> Measurement:
    """The sums of an event as one measurement.

    Nuisances, each with a prior of its own deviation, are eliminated one by one (Schur complements). What an event's
    model may be wrong by adds its variance f^2 to what is left of the information A,

        A' = (I + f^2 A)^-1 A = L D L'.

    An event tells one combination of the two: the first row of L' is a measurement with the variance 1/D_1, and the
    other one has next to no information (a decay tells k/c alone).
    """
    normal = {pair: state.normal[",".join(pair)] for pair in _PAIRS}
    right = dict(state.right)
    for k, one in reversed(list(enumerate(_NAMES))[len(EVENT_QUANTITIES) :]):
        left = _NAMES[:k]
        pivot = normal[one, one] + 1.0
        by = {name: normal[name, one] / pivot for name in left}
        right = {i: right[i] - by[i] * right[one] for i in left}
        normal = {(i, j): normal[i, j] - by[i] * normal[j, one] for i, j in normal if one not in (i, j)}
    leak, stiff = EVENT_QUANTITIES
    a, b, c = normal[leak, leak], normal[leak, stiff], normal[stiff, stiff]
    floor2 = ca.if_else(state.stands, EVENT_STANDING_STD, EVENT_MOVING_STD) ** 2
    both = ca.fmax(a * c - b * b, 0.0)
    # (I + f^2 A)^-1 of a matrix of two rows, in closed form.
    scale = 1.0 + floor2 * (a + c) + floor2**2 * both
    right_leak = ((1.0 + floor2 * c) * right[leak] - floor2 * b * right[stiff]) / scale
    known, crossed = ca.fmax((a + floor2 * both) / scale, TINY), b / scale
    row: dict[Quantity, Real] = {leak: scalar(1.0), stiff: crossed / known}
    sampling = EVENT_SAMPLING * ca.fmin(elapsed, GAP_PERIOD) ** 2
    # A torque that is too large by friction makes both factors too small by as much; at standstill it is a nuisance.
    friction = ca.if_else(state.stands, 0.0, EFFICIENCY_STD * (1.0 + row[stiff]))
    return Measurement(
        use=ends,
        innovation=right_leak / known,
        H={**row, Quantity.RELEASE: ca.if_else(state.stands, row[leak], 0.0)},
        at=point,
        R=1.0 / known,
        gate=LIKELY_STDS,
        teaches=dict.fromkeys((Quantity.POSITION, *EVENT_QUANTITIES, *SHARED), True),
        power=EVENT_COUNTS,
        common=ca.sqrt(sampling**2 + friction**2),
    )
