"""How leakage changes while the machine works: with the oil in the gaps, and with the pressure.

    leak = factor * exp(lag * d ln(nu)/dt - warmer * d ln(nu)/dT) * (p / p_ref)^(-e)

The described leakage takes the reported temperature for that of the oil in the pumps' gaps. A thermometer in the tank
is late by `lag`, and the oil in the gaps may be `warmer` all the time: in cold oil each kelvin is 6 % of leakage, in
warm oil 3 %, so that a machine that warms up tells one from the other. And leakage has a law of pressure, laminar gaps
as a rule, in which it grows with the pressure itself; where a part of it goes through orifices, past a seal or along
wider gaps it grows otherwise, by an exponent `e` less. All are quantities that the filter learns (`hypotheses`). The
pressure is that of the torque.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from ramsight.sensor.virtual_sensor import SensorGraph

_SLOWEST = 20.0  # s; time constant of the slow temperature, from whose distance the rate of change follows
_SURELY = 3.0  # of these time constants until the difference is the oil's
_INSTANT = 1e-3  # s
_KELVIN = 1.0  # K; for the slope of the viscosity's logarithm, which changes by a hundredth over it
_REFERENCE = 0.3  # share of the torque at relief pressure at which the exponent changes nothing
_LEAST, _MOST = 0.05, 1.0  # shares of it between which the exponent is used


class Leaking:
    """The factor of leakage at a sample, and how it follows what the filter learns.

    Args:
        graph: gains states.
        viscosity: of the oil over its temperature [K].
        first: whether this is the first sample.
        torque: as last expected, over that at relief pressure [1].

    Attributes:
        change: logarithm of the viscosity some time ago over now: how much leakage has grown meanwhile [1].
        slow: the time that is `change` over its rate [s].
    """

    slow = _SLOWEST

    def __init__(self, graph: SensorGraph, viscosity: Any, first: Any, torque: Any) -> None:
        before, age, t = graph.state("slow_temperature"), graph.state("age"), graph.oil_temperature
        dt = graph.elapsed
        before = ca.if_else(first, t, before)
        after = before + dt / (ca.fmin(age, _SLOWEST) + dt + _INSTANT) * (t - before)
        graph.becomes("slow_temperature", after)
        graph.becomes("age", age + dt)
        # Two filters that begin with the same noisy sample are apart by that noise for a while.
        surely = ca.fmin(age / (_SURELY * _SLOWEST), 1.0)
        gaps = graph.pump_temperature
        # A late thermometer is not late for how much warmer the gaps are.
        self.change = surely * ca.log(viscosity(after + graph.warmer) / viscosity(gaps))
        self._rate = self.change / _SLOWEST
        self._per_kelvin = ca.log(viscosity(gaps) / viscosity(gaps + _KELVIN)) / _KELVIN
        share = ca.fmin(ca.fmax(ca.fabs(torque), _LEAST), _MOST)
        self._under = ca.log(_REFERENCE / share)

    def factor(self, leak: Any, lag: Any, exponent: Any, *warmer: Any) -> Any:
        """The factor at this sample [1]; by how much the oil is `warmer` [K] only where that is learned."""
        return leak * self._scale(lag, exponent, *warmer)

    def at_reported(self, leak: Any, warmer: Any) -> tuple[Any, list[Any]]:
        """Leakage over the described one of the oil that is reported, and its derivatives by both [1, 1/K]."""
        scale = ca.exp(warmer * self._per_kelvin)
        return leak * scale, [scale, leak * scale * self._per_kelvin]

    def _scale(self, lag: Any, exponent: Any, *warmer: Any) -> Any:
        return ca.exp(lag * self._rate + exponent * self._under + sum(one * self._per_kelvin for one in warmer))

    def derivatives(self, by: Sequence[Any], leak: Any, lag: Any, exponent: Any, *warmer: Any) -> list[Any]:
        """Derivatives with respect to what the filter learns, from those with respect to the factors.

        Args:
            by: with respect to leakage, displacement and compliance, leakage as it is at this sample.
            leak: factor as believed [1].
            lag: as believed [s].
            exponent: as believed [1].
            warmer: as believed [K], where it is learned.

        Returns:
            With respect to leakage, displacement, compliance, lag and exponent, and to `warmer` where it is learned.
        """
        factor = self.factor(leak, lag, exponent, *warmer)
        scale = self._scale(lag, exponent, *warmer)
        found = [by[0] * scale, by[1], by[2], by[0] * factor * self._rate, by[0] * factor * self._under]
        return found + [by[0] * factor * self._per_kelvin for _ in warmer]
