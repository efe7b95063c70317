"""Poses in a plane, x forward and z up, and the triangle that closes a loop; numbers and CasADi symbols alike."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Real


@dataclass(frozen=True)
class Pose:
    """Where a body is: it maps points of the drawing to where they are now."""

    # from_x, from_z: a point of the body in the drawing [m]
    from_x: Real = 0.0
    from_z: Real = 0.0
    # x, z: where that point is now [m]
    x: Real = 0.0
    z: Real = 0.0
    # cosine, sine: of the angle by which the body is turned, from x towards z
    cosine: Real = 1.0
    sine: Real = 0.0

    def at(self, x: Real, z: Real) -> tuple[Real, Real]:
        """Where a point of the drawing [m] is now [m]."""
        dx, dz = self.turned(x - self.from_x, z - self.from_z)
        return self.x + dx, self.z + dz

    def turned(self, x: Real, z: Real) -> tuple[Real, Real]:
        """A direction of the drawing, as it points now."""
        return self.cosine * x - self.sine * z, self.sine * x + self.cosine * z

    def turn_about(self, x: Real, z: Real, cosine: Real, sine: Real) -> Pose:
        """Pose of a body that is turned against this one about a pin, a point of the drawing [m]."""
        now = self.at(x, z)
        both = self.cosine * cosine - self.sine * sine, self.sine * cosine + self.cosine * sine
        return Pose(x, z, *now, *both)

    def slide(self, direction_x: Real, direction_z: Real, way: Real) -> Pose:
        """Pose of a body that has slid against this one, by a way [m] along a direction of the drawing."""
        dx, dz = self.turned(direction_x, direction_z)
        return Pose(self.from_x, self.from_z, self.x + way * dx, self.z + way * dz, self.cosine, self.sine)

    @property
    def angle(self) -> Real:
        """Angle by which the body is turned [rad], from -pi to pi."""
        return ca.atan2(self.sine, self.cosine)


def arm_to(arm_x: Real, arm_z: Real, far_x: Real, far_z: Real, length: Real, side: Real) -> tuple[Real, Real]:
    """Cosine and sine of the angle by which an arm has to turn so that its end is at a distance from a point.

    The arm's end and the point that is looked for lie on two circles; of their two intersections the one on
    `side` is chosen: u = (k d + side h d_perp)/d^2 with k = (r^2 + d^2 - length^2)/2, h^2 = r^2 d^2 - k^2. Where the
    circles do not meet the result is NaN.

    Args:
        arm_x: the arm as drawn, from its pin to its end, forward [m].
        arm_z: the same, up [m].
        far_x: from the arm's pin to the point, now, forward [m].
        far_z: the same, up [m].
        length: distance from the arm's end to the point [m].
        side: +1 if the arm is turned from the line to the point towards z as x is, -1 if the other way.

    Example:
        >>> c, s = arm_to(3.0, 0.0, 5.0, 0.0, 4.0, 1.0)  # a triangle of sides 3, 4 and 5
        >>> round(c, 12), round(s, 12)
        (0.6, 0.8)
    """
    r2, d2 = arm_x * arm_x + arm_z * arm_z, far_x * far_x + far_z * far_z
    k = 0.5 * (r2 + d2 - length * length)
    h = side * ca.sqrt(r2 * d2 - k * k)
    u_x, u_z = (k * far_x - h * far_z) / d2, (k * far_z + h * far_x) / d2
    return (u_x * arm_x + u_z * arm_z) / r2, (u_z * arm_x - u_x * arm_z) / r2


def side_of(arm_x: float, arm_z: float, far_x: float, far_z: float) -> float:
    """The side of a triangle as it is drawn, for `arm_to`: +1 or -1."""
    return 1.0 if far_x * arm_z - far_z * arm_x >= 0.0 else -1.0


def way_to(gap_x: Real, gap_z: Real, direction_x: Real, direction_z: Real, length: Real, side: Real) -> Real:
    """How far a sliding point has to go to be at a distance from another one [m].

    Args:
        gap_x: from the other point to the sliding one, before it slides, forward [m].
        gap_z: the same, up [m].
        direction_x: of sliding, forward; of length 1.
        length: the distance [m].
        side: +1 if the slider goes away from the point with growing distance, -1 if towards it.
    """
    along = gap_x * direction_x + gap_z * direction_z
    return side * ca.sqrt(along * along - gap_x * gap_x - gap_z * gap_z + length * length) - along
