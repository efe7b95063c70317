"""Pressures and volume balance of a unit whose position is known, for factors by which it differs from its data sheet.

    A x = int (D w - leakage) dt - C_manifold p_manifold - C_chamber p_chamber + const

on the side that holds the load, at every sample at which its chamber is joined to its manifold. The motor's torque
carries the pressures of both manifolds; the other side's follows from its own balance, whose piston is known.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.calibration.flow_law import FlowLaw, columns
from ramsight.plant.pump import friction_coefficient
from ramsight.plant.unit import opposite

if TYPE_CHECKING:
    from ramsight.plant.ddh import DdhUnit, Side

Array = NDArray[np.float64]

MOVING = 2e-3  # m/s; what the smoothed velocity has to reach in a move
_SMOOTH = 0.1  # s; over which position is averaged, and
_STILL = 2.0  # s; over which oil temperature is


@dataclass(frozen=True)
class Deviation:
    """How a machine differs from its data sheet.

    Attributes:
        leak: laminar leakage of both pumps over the data sheet's [1].
        orifice: leakage like an orifice's at the nominal pressure, over the data sheet's laminar one there [1].
        displacement: of both pumps over the data sheet's [1].
        compliance: of oil and hoses over the data sheet's [1].
        delay: by which the position lags the log [s].
    """

    leak: float = 1.0
    orifice: float = 0.0
    displacement: float = 1.0
    compliance: float = 1.0
    delay: float = 0.0

    def law(self, side: Side) -> FlowLaw:
        """The flow law of a side's pump with this wear."""
        sheet = FlowLaw.of(side.pump)
        return FlowLaw(
            sheet.displacement * self.displacement,
            sheet.laminar * self.leak,
            self.orifice * orifice_at_one(side),
        )


def orifice_at_one(side: Side) -> float:
    """Orifice conductance that leaks as much at the nominal point as the data sheet's gaps do [m3/s/sqrt(Pa)]."""
    pump = side.pump
    nominal = pump.displacement * pump.nominal_speed * (1.0 - pump.volumetric_efficiency)
    return float(nominal / np.sqrt(pump.nominal_pressure))


class Record:
    """A drive log with the position beside it, as arrays at the log's times.

    Args:
        time: [s], shape (n,).
        motor_speed: [rad/s].
        motor_torque: [N m].
        oil_temperature: [K].
        position: [m].
    """

    def __init__(
        self, time: Array, motor_speed: Array, motor_torque: Array, oil_temperature: Array, position: Array
    ) -> None:
        self.time, self.motor_speed, self.motor_torque = time, motor_speed, motor_torque
        self.period = float(np.median(np.diff(time)))
        self.oil_temperature = running_mean(oil_temperature, _samples(_STILL, self.period))
        self.position = running_mean(position, _samples(_SMOOTH, self.period))
        # A drive reports speed in steps; half of one is what a constant speed may be off.
        steps = np.abs(np.diff(np.unique(motor_speed)))
        self.speed_step = float(steps.min()) if steps.size else 0.0

    @property
    def largest_torque(self) -> float:
        """The largest torque either way, but for a thousandth of the samples [N m]."""
        return float(np.quantile(np.abs(self.motor_torque), 0.999))

    def changed(self, *, kelvin: float = 0.0, torque: float = 0.0, offset: float = 0.0) -> Record:
        """The record with warmer oil [K], a share more torque [1], or another zero of the torque [N m]."""
        copy = object.__new__(Record)
        copy.__dict__.update(self.__dict__)
        copy.oil_temperature = self.oil_temperature + kelvin
        copy.motor_torque = self.motor_torque * (1.0 + torque) + offset
        return copy


@dataclass(frozen=True)
class Balance:
    """The held side's oil at every sample, and what presses on the piston.

    Attributes:
        content: what the pump has moved into the side since the start, less what is compressed there and what the
            piston took [m3]; constant, but for errors, while no oil goes elsewhere.
        pressure: in the held manifold, above tank [Pa]; with the torque's noise.
        other: in the other chamber, above tank [Pa].
        force: of the oil against load and friction, in the lifting direction [N]; mass already taken off.
        velocity: in the lifting direction [m/s].
    """

    content: Array
    pressure: Array
    other: Array
    force: Array
    velocity: Array


class Hydraulics:
    """The unit's numbers, laid out once for many evaluations.

    Args:
        unit: its parts, as the data sheet has them.
        record: what was recorded.
    """

    def __init__(self, unit: DdhUnit, record: Record) -> None:
        self.unit, self.record = unit, record
        self.held, self.other = unit.held_side, unit.b if unit.held == "a" else unit.a
        name = unit.held
        self.held_flow, self.other_flow = (1.0, -1.0) if name == "a" else (-1.0, 1.0)
        cylinder, oil = unit.cylinder, unit.oil
        self.area, self.other_area = cylinder.area(name), cylinder.area(opposite(name))
        self.dead, self.other_dead = cylinder.dead_volume(name), cylinder.dead_volume(opposite(name))
        self.density = np.broadcast_to(oil.density_at(record.oil_temperature), record.time.shape)
        self.viscosity = _numbers(oil.viscosity(ca.DM(record.oil_temperature))) * self.density
        step = np.diff(record.time, prepend=record.time[0])
        self.step, self.angle = step, _between(record.motor_speed) * step
        self.travel = record.position if unit.lift_sign > 0.0 else cylinder.stroke - record.position

    def capacity(self) -> Array:
        """Of the held hose and chamber, by the data sheet [m3/Pa], shape (n,)."""
        hose, beta = self.held.hose, self.unit.oil.bulk_modulus
        return np.asarray(hose.volume / hose.bulk_modulus + (self.dead + self.area * self.travel) / beta)

    def balance(self, how: Deviation) -> Balance:
        """The held side's oil under a deviation from the data sheet."""
        unit, record, lift = self.unit, self.record, self.unit.lift_sign
        law, other_law = how.law(self.held), how.law(self.other)
        speed, dt = record.motor_speed, self.step
        rate = np.gradient(record.motor_speed, record.time)
        torque = record.motor_torque - unit.drive.inertia * rate
        slopes = []
        for side, flow in ((self.held, self.held_flow), (self.other, self.other_flow)):
            pump = side.pump
            direction = np.tanh(4.0 * pump.belt * speed / pump.threshold_speed)
            torque = torque - pump.belt * pump.no_load_torque * direction
            displacement = pump.displacement * how.displacement
            friction = friction_coefficient(displacement, pump.hydromechanical_efficiency)
            slopes.append(pump.belt * (flow * displacement + direction * friction))
        other = self._other_pressure(how, other_law)
        pressure = (torque - slopes[1] * other) / slopes[0]
        delivered = self.held_flow * law.displacement * self.held.pump.belt
        at_sample = columns(0.0, pressure, self.viscosity) @ law.coefficients
        if unit.oil.pressure_viscosity is not None:
            thick = _numbers(unit.oil.thickening(ca.DM(unit.tank_pressure + 0.5 * pressure)))
            at_sample = columns(0.0, pressure, self.viscosity * thick) @ law.coefficients
        pumped = np.cumsum(delivered * self.angle + _between(at_sample) * dt)
        velocity = lift * np.gradient(record.position, record.time)
        flow = self.area * velocity
        drop = self._drop(self.held, flow)
        chamber = pressure - drop
        stored = self.held.manifold.volume / unit.oil.bulk_modulus * pressure + self.capacity() * chamber
        # int C dp, not C p: oil that fills a growing chamber at constant pressure is not compressed.
        moving = np.abs(velocity) > MOVING
        if moving.any():
            known = np.interp(record.time, record.time[moving], chamber[moving])
            growth = self.area / unit.oil.bulk_modulus * np.diff(self.travel, prepend=self.travel[0])
            stored -= np.cumsum(_between(known) * growth)
        late = self.area * how.delay * velocity
        content = pumped - how.compliance * stored - self.area * self.travel - late
        other_drop = self._drop(self.other, self.other_area * velocity)
        acceleration = delivered * rate / self.area
        force = self.area * chamber - self.other_area * (other + other_drop) - unit.cylinder.mass * acceleration
        return Balance(content, pressure, other, force, velocity)

    def _drop(self, side: Side, flow: Array) -> Array:
        """Pressure drop of open valve and hose at a flow [Pa]."""
        kinematic = ca.DM(self.viscosity / self.density)
        hose = _numbers(side.hose.pressure_drop(ca.DM(flow), kinematic, ca.DM(self.density)))
        return np.asarray(np.sign(flow) * (flow / side.safety.conductance) ** 2 + hose)

    def _other_pressure(self, how: Deviation, law: FlowLaw) -> Array:
        """The other side's pressure above tank [Pa]; what it lacks it draws from the tank."""
        unit, other = self.unit, self.other
        beta = unit.oil.bulk_modulus
        room = unit.cylinder.stroke - self.travel
        fixed = (other.hose.volume / other.hose.bulk_modulus) + other.manifold.volume / beta
        capacity = how.compliance * (fixed + (self.other_dead + self.other_area * room) / beta)
        brought = self.other_flow * law.displacement * other.pump.belt * self.angle
        net = brought - self.other_area * np.diff(room, prepend=room[0])
        leak = law.laminar / self.viscosity * self.step
        orifice = law.orifice * self.step
        lowest, highest = -other.anticavitation.cracking_pressure, other.relief.setting
        result, p = np.empty(len(net)), 0.0
        for k, (volume, c, per_pressure, through) in enumerate(
            zip(net.tolist(), capacity.tolist(), leak.tolist(), orifice.tolist(), strict=True)
        ):
            # Linearised at the last pressure, so that a leak faster than a sample does not overshoot.
            slope = per_pressure + (through / (p * p + 4e6) ** 0.25 if through else 0.0)
            p = min(max((c * p + volume) / (c + slope), lowest), highest)
            result[k] = p
        return result


def running_mean(values: Array, width: int) -> Array:
    """Mean over an odd number of samples around each, fewer at the ends."""
    if width < 2:
        return values.astype(np.float64)
    half = width // 2
    total = np.concatenate([[0.0], np.cumsum(values)])
    index = np.arange(len(values))
    first, last = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    reach = np.minimum(index - first, last - 1 - index)  # symmetrical, so that a ramp stays a ramp
    first, last = index - reach, index + reach + 1
    return np.asarray((total[last] - total[first]) / (last - first))


def _samples(seconds: float, period: float) -> int:
    return max(1, round(seconds / period))


def _between(values: Array) -> Array:
    """Mean of each sample and the one before."""
    return np.asarray(0.5 * (values + np.concatenate([values[:1], values[:-1]])))


def _numbers(values: ca.DM) -> Array:
    numbers: Array = np.array(values, dtype=np.float64)
    return numbers.ravel()
