"""What a motion weighed by the described machine alone, as values of a recursion; the tally takes them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Flag, Real, Scalar, all_of, negated
from ramsight.tool import weighing_limits as limit
from ramsight.tool.force_scale import TERMS
from ramsight.tool.lift_blocks import Motion
from ramsight.tool.lift_window import Changes, Window
from ramsight.tool.weighing_events import Quality

QUALITIES = tuple(Quality)
"""Their places are what a recursion gives."""


@dataclass(frozen=True)
class LiftValues:
    """A lift as `Plain` has it."""

    row: tuple[Scalar, ...] = leaf("1", None)  # change of the mass by each term of the scale
    others: tuple[Scalar, ...] = leaf("m", None)  # positions of the other units
    time: Scalar = leaf("s")
    duration: Scalar = leaf("s")
    upwards: Flag = leaf("1")
    mass: Scalar = leaf("kg", math.nan)
    own_std: Scalar = leaf("kg", math.nan)
    quality: Scalar = leaf("1")  # place in `QUALITIES`
    # per_mass, moment_std, covered: of the load moment; NaN where there is none
    per_mass: Scalar = leaf("1/kg", math.nan)
    moment_std: Scalar = leaf("1", math.nan)
    covered: Flag = leaf("1")

    @classmethod
    def none(cls, units: int) -> LiftValues:
        """No lift, of a mechanism with so many units."""
        zero = ca.SX(0.0)
        return cls((zero,) * len(TERMS), (zero,) * (units - 1))

    @property
    def is_good(self) -> Flag:
        """Whether its mass may be used."""
        return self.quality == float(QUALITIES.index(Quality.GOOD))


def root_sum(*parts: Real) -> Scalar:
    """Root of the sum of squares."""
    return ca.sqrt(sum((part * part for part in parts), start=ca.SX(0.0)))


def lift_of(window: Window, motion: Motion, rated: float) -> LiftValues:
    """What a motion that has ended weighed.

    Args:
        rated: payload [kg].
    """
    sums, count = window.sums, ca.fmax(window.count, 1.0)
    duration = window.last - window.first
    mass, push, shift = sums.mass, sums.pf / sums.pp, window.payload / sums.pp
    part, noise = window.part, _noise(window, duration)
    # A part that has not ended counts from half the usual length on.
    counts = part.count >= 0.5 * ca.fmax(window.changes.longest, part.count)
    changes = chosen(counts, window.changes.and_part(part), window.changes)
    observed = shift * ca.sqrt(window.variance / count) / ca.sqrt(ca.fmax(duration / limit.BLOCK, 1.0))
    by_noise = ca.fmin(noise / ca.sqrt(ca.fmax(changes.parts, 1.0)), observed)
    by_position = _farthest([one.mass - mass for one in window.varied])
    repeats = limit.REPEATS_STD * ca.fabs(push)
    quality = _quality(window, changes, duration, by_position, noise, rated)
    per_mass, moment_std, covered = _moment(window, mass, root_sum(by_noise, repeats))
    is_any = window.count > 0.0
    direction = motion.direction
    return LiftValues(
        time=motion.started + window.time / count,
        duration=duration,
        upwards=direction > 0.0,
        mass=ca.if_else(is_any, mass, math.nan),
        own_std=ca.if_else(is_any, root_sum(by_noise, by_position, repeats), math.nan),
        quality=ca.if_else(is_any, quality, float(QUALITIES.index(Quality.TOO_SHORT))),
        row=(push, direction * push, shift, direction * shift),
        others=window.others,
        per_mass=per_mass,
        moment_std=moment_std,
        covered=covered,
    )


def _noise(window: Window, duration: Scalar) -> Scalar:
    """Deviation that noise gives the mass of a part [kg], by the steps from sample to sample."""
    steps = ca.fmax(window.steps, 1.0)
    variance = window.step_squares / steps - (window.step / steps) ** 2
    samples = ca.fmax(window.count * limit.BLOCK / ca.fmax(duration, limit.BLOCK), 1.0)
    return ca.sqrt(ca.fmax(variance, 0.0) / (2.0 * samples))


def _farthest(changes: list[Scalar]) -> Scalar:
    """Deviation by a slope and by each position, of which the side that changes more counts."""
    slope, *sides = changes
    pairs = zip(sides[::2], sides[1::2], strict=True)
    return root_sum(slope, *(ca.fmax(ca.fabs(one), ca.fabs(other)) for one, other in pairs))


def _moment(window: Window, mass: Scalar, by_force: Scalar) -> tuple[Scalar, Scalar, Flag]:
    moments = window.moments
    if moments is None:
        return ca.SX(math.nan), ca.SX(math.nan), ca.SX(0.0)
    here, *varied = moments.most
    changes = [sums.mass * most - mass * here for sums, most in zip(window.varied, varied, strict=True)]
    is_any = moments.inside > 0.0
    std = root_sum(here * by_force, _farthest(changes))
    return ca.if_else(is_any, here, math.nan), ca.if_else(is_any, std, math.nan), moments.outside == 0.0


def _quality(
    window: Window, changes: Changes, duration: Scalar, by_position: Scalar, noise: Scalar, rated: float
) -> Scalar:
    """Why a lift's mass is bad, the first cause first."""
    count = ca.fmax(window.count, 1.0)
    speed = window.speed / count
    variance = ca.fmax(window.speed_squares / count - speed**2, 0.0)
    varies = ca.sqrt(variance) > limit.SPEED_VARIES * ca.fabs(speed)
    is_steady = all_of(window.steady >= limit.STEADY_SHARE * window.count, negated(varies))
    changed = all_of(changes.parts > 1.0, changes.high - changes.low > limit.CHANGES * rated + limit.NOISE_STDS * noise)
    fell = all_of(changes.step > 0.0, changes.explained >= limit.ONE_STEP * changes.variance)
    known = by_position <= limit.POSITION_SHARE * rated
    causes = (
        (Quality.SPILLED, all_of(changed, fell)), (Quality.DIGGING, all_of(changed, negated(fell))),
        (Quality.TOO_FAST, negated(is_steady)), (Quality.UNKNOWN_POSITION, negated(known)),
        (Quality.TOO_SHORT, duration < limit.SHORTEST),
    )  # fmt: skip
    quality: Scalar = ca.SX(float(QUALITIES.index(Quality.GOOD)))
    for cause, holds in causes:
        quality = ca.if_else(holds, float(QUALITIES.index(cause)), quality)
    return quality
