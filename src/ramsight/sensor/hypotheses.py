"""What is not known of the machine, under several hypotheses of where its stops are.

Each hypothesis has its own position, factors (`ramsight.plant.balance.FACTORS`), lag of the thermometer and places of
the two ends, with their covariance (a Kalman filter of eight states around the load observer's step). They differ in
what they believe of the ends and of the start:

    as described   both ends are where the description says
    leaks          so they are, and the pumps leak much more or less than described, or by another law of pressure
    low, top       the end of the stroke is met somewhere else at the retracted, at the extended end
    wrong          nobody knows where the piston is; both ends are where the description says

A contact or a reference is a measurement of each of them, weighed by its likelihood; under each it may also be an
obstacle (or a switch that lies), which is then not used. An end met again and again where it is not expected makes
hypotheses of undeclared ends likely and moves no position; references that agree with each other make *wrong* likely,
and the position is found anew. The position said is that of the likeliest, its deviation that of all together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.hypothesis import (
    COMPLIANCE,
    DISPLACEMENT,
    LEAK,
    LEAKS,
    LOW,
    NAMES,
    OFFSET,
    POSITION,
    TOP,
    WARMER,
    WRONG,
    Hypothesis,
)
from ramsight.sensor.mixture import CERTAIN, OUTSIDE, Mixture
from ramsight.sensor.uncertainty import Covariance
from ramsight.sensor.virtual_sensor import SensorGraph

_NEVER = 1e9  # a logarithm that no likelihood reaches
_LEAST = -12.0  # natural logarithm of the least weight over the largest, so that a hypothesis can come back
_TURNED = 0.5  # of what a piston seemed to be beyond an end that it leaves: standard deviation that it leaves there
_BEYOND, _BEYOND_LEAST = 4.0, 5e-3  # standard deviations and share of the stroke; so far beyond an end none is
_ADAPTS = 0.2  # share of the newest reference in the mean of the normalised innovations
_MOST = 25.0  # of a normalised innovation; a larger one is none of a walk
_STEP = 0.3  # of the logarithm of the band's width, by which a reference outside it widens it


def _likelihood(innovation2: Any, variance: Any) -> Any:
    """Logarithm of a normal density, by the square of the innovation."""
    return -0.5 * (innovation2 / variance + ca.log(2.0 * math.pi * variance))


@dataclass(frozen=True)
class Measured:
    """What a reference or a contact did.

    Attributes:
        taken: the likeliest hypothesis used it.
        refused: it did not.
        moved: by how much that moved the nominal position [m].
    """

    taken: Any
    refused: Any
    moved: Any


class Hypotheses:
    """The hypotheses as states of a sensor's graph.

    Args:
        graph: gains states.
        stroke: of the cylinder [m]; number or symbol.
        assumptions: of machine and stops.
        known: whether a position is known at all.
        first: whether this is the first sample.
        start_variance: of the position at the start [m2].
        with_link: whether the angle of the body that the cylinder turns is measured.
    """

    def __init__(
        self,
        graph: SensorGraph,
        stroke: float,
        assumptions: Assumptions,
        *,
        known: Any,
        first: Any,
        start_variance: Any,
        with_link: bool = False,
    ) -> None:
        self._graph, self._assumptions, self._with_link = graph, assumptions, with_link
        learns_warmer = assumptions.thermometer.offset > 0.0
        # Which of all quantities there are, in the order of the means.
        self._kept_of = (*range(OFFSET), *([OFFSET] if with_link else []), *([WARMER] if learns_warmer else []))
        self._size = len(self._kept_of)
        # Those that the step is made with.
        self._stepping = (*range(LEAK, LOW), *([self._size - 1] if learns_warmer else []))
        self._stroke = graph.parameters.add("stroke", stroke)
        machine, stops, lag = assumptions.machine, assumptions.stops, assumptions.thermometer
        usual = (machine.leak, machine.leak_exponent)
        other = (max(machine.leak, machine.other_leak), max(machine.leak_exponent, machine.other_exponent))
        described, odds = 1.0 - 2.0 * stops.undeclared, machine.leaks_otherwise / (1.0 - machine.leaks_otherwise)
        priors = {
            "described": (described, stops.std, stops.std, usual),
            "leaks": (described * odds, stops.std, stops.std, other),
            "low": (stops.undeclared, stops.elsewhere, stops.std, usual),
            "top": (stops.undeclared, stops.std, stops.elsewhere, usual),
            "wrong": (stops.wrong, stops.std, stops.std, other),
        }
        self._unknown = 0.5 * self._stroke
        self.all: list[Hypothesis] = []
        for name, (probability, low, top, (leak, exponent)) in priors.items():
            means = (0.0, 1.0, 1.0, 1.0, lag.lag, 0.0, stops.retracted, -stops.extended, 0.0, 0.0)
            mean = [graph.state(f"{name}_{k}", value) for k, value in enumerate(self._of(means))]
            factors = (leak, machine.displacement, machine.compliance)
            prior = (0.0, *factors, lag.lag_std, exponent, low * stroke, top * stroke)
            std = (*prior, assumptions.link_angle.offset, lag.offset)
            covariance = Covariance(graph, self._of(std), prefix=f"{name}_")
            least = ca.if_else(known, start_variance, self._unknown**2) if name != "wrong" else self._unknown**2
            covariance.raise_to(POSITION, ca.if_else(first, least, 0.0))
            weight = graph.state(f"{name}_weight", math.log(probability))
            self.all.append(Hypothesis(mean, covariance, weight))
        self._together = Mixture(self.all, assumptions.stops.wrong)
        self._adapt = graph.state("innovations")  # their mean square over the expected one, less 1
        self._width = graph.state("band_width", 1.0)

    def _of(self, values: Sequence[Any]) -> list[Any]:
        """Those of the quantities that there are, of one for each."""
        return [values[k] for k in self._kept_of]

    def _stepped(self, one: Hypothesis) -> list[Any]:
        """What the step is made with, as a hypothesis has it."""
        return [one.mean[k] for k in self._stepping]

    def _row(self, by: list[Any], rest: Sequence[Any] = ()) -> list[Any]:
        """Derivatives of something with respect to the position and what a step is made with, and to what is left.

        Args:
            by: with respect to position, factors, lag and exponent, and to `WARMER` where it is learned.
            rest: with respect to the ends' places and the link's error.
        """
        row = [*by[:LOW], *rest, *(0.0 for _ in range(WARMER + 1))]
        row[WARMER] = by[LOW] if len(by) > LOW else 0.0
        return self._of(row)

    def means(self) -> list[Any]:
        """Factors, lag and exponent over all hypotheses, and how much warmer the oil is where that is learned."""
        return [self._together.mean(k) for k in self._stepping]

    def probabilities(self) -> dict[str, Any]:
        """Of each hypothesis, by its name."""
        return dict(zip(NAMES, self._together.probabilities(), strict=True))

    def predict(self, travel: Any, travel_by: list[Any], around: list[Any], noise: Any, grows: Any, leak: Any) -> None:
        """Go with the load observer's step.

        Args:
            travel: of the piston [m].
            travel_by: its derivatives with respect to factors and lag [m, m/s].
            around: factors and lag that the step was made with.
            noise: variance that the position gains beside the way's [m2].
            grows: by which the position's standard deviation grows as a whole [m].
            leak: standard deviation that the leakage gains beside its walk [1].
        """
        machine, dt = self._assumptions.machine, self._graph.elapsed
        adapt = 1.0 + ca.fmax(self._adapt, 0.0)
        walk = [machine.leak_walk**2 * dt * adapt + leak**2, machine.displacement_walk**2 * dt]
        walk += [machine.compliance_walk**2 * dt, 0.0, 0.0, 0.0, 0.0, self._assumptions.link_angle.drift**2 * dt, 0.0]
        along = machine.walk**2 * ca.fabs(travel) + noise
        for h in self.all:
            other = zip(travel_by, self._stepped(h), around, strict=True)
            h.mean[POSITION] = h.mean[POSITION] + sum(by * (mine - used) for by, mine, used in other)
            h.covariance.predict(self._row([0.0, *travel_by]), self._of([along, *walk]))
            h.covariance.grow(grows)

    def shift(self, by: Any) -> None:
        """The position is another than the way says, under each hypothesis, by so much [m]."""
        for h in self.all:
            h.mean[POSITION] = h.mean[POSITION] + by

    def confine(self, nominal: Any, passes: Any, passed: Any) -> None:
        """Oil that may pass a relief valve takes the piston under no hypothesis far beyond the cylinder's ends.

        A little is left, for how far it seems to be beyond an end is what a contact tells of the machine.

        Args:
            nominal: position after the step [m].
            passes: whether oil may.
            passed: standard deviation of the position by what may have passed since a reference [m].
        """
        for h in self.all:
            far, position = self._far(h, passed), nominal + h.mean[POSITION]
            back = ca.fmax(-far - position, 0.0) - ca.fmax(position - self._stroke - far, 0.0)
            h.mean[POSITION] = h.mean[POSITION] + ca.if_else(passes, back, 0.0)

    def turned(self, nominal: Any, way: Any) -> None:
        """A piston that leaves an end which the pump's oil did not press it on is not beyond it.

        Oil that was drawn from the tank explains how far it seemed to be, and how much that was nothing says; so the
        position is as unsure as half of that besides.

        Args:
            nominal: position after the step [m].
            way: in which the motor moves it away from such an end, +1 for extension; 0 if it does not.
        """
        for h in self.all:
            position = nominal + h.mean[POSITION]
            beyond = ca.if_else(way > 0.0, -position, ca.if_else(way < 0.0, position - self._stroke, 0.0))
            back = ca.if_else(beyond > h.position_std + _BEYOND_LEAST * self._stroke, beyond, 0.0)
            h.mean[POSITION] = h.mean[POSITION] + way * back
            h.covariance.grow(_TURNED * back)

    def room(self, way: Any, passed: Any) -> Any:
        """How far the piston may still go [m]; oil that is delivered beyond moves nothing, and makes nothing unsure.

        Args:
            way: that it goes, the sign of its velocity.
            passed: standard deviation of the position by what may have passed a relief valve [m].
        """
        position = self._graph.position
        ahead = ca.if_else(way > 0.0, self._stroke - position, position)
        return ca.fmax(ahead + self._together.best([self._far(h, passed) for h in self.all]), 0.0)

    def _far(self, h: Hypothesis, passed: Any) -> Any:
        """How far beyond an end a piston may seem to be [m]; what passed a relief valve took it nowhere."""
        return _BEYOND * ca.fmax(h.position_std - passed, 0.0) + _BEYOND_LEAST * self._stroke

    def floor(self, leak: Any) -> None:
        """Leakage is never better known than this standard deviation [1]."""
        for h in self.all:
            h.covariance.raise_to(LEAK, leak**2)

    def torque(
        self,
        row: list[Any],
        around: list[Any],
        surprise: Any,
        variance: Any,
        inflation: Any,
        *,
        leak: Any,
        compliance: Any,
    ) -> None:
        """A torque that does not depend on the load tells leakage or compliance; all else is considered.

        One that a hypothesis holds for impossible teaches it nothing: a machine does not change so much, but an input
        that is wrong looks as if it did.

        Args:
            row: derivatives of the torque with respect to factors and lag [N m, N m/s].
            around: the values that it was expected with.
            surprise: torque less the expected one [N m].
            variance: of the torque [N2 m2].
            inflation: of that variance, because errors of samples that follow each other are the same ones [1].
            leak: whether it tells the leakage.
            compliance: whether it tells the compliance.
        """
        full = self._row([0.0, *row])
        before = self._kept()
        for h in self.all:
            own = sum(by * (m - used) for by, m, used in zip(row, self._stepped(h), around, strict=True))
            missing = surprise - own
            fits = missing**2 < CERTAIN**2 * (h.covariance.variance(full) + variance)
            use = {LEAK: ca.logic_and(leak, fits), COMPLIANCE: ca.logic_and(compliance, fits)}
            h.correct(h.covariance.consider(full, missing, variance * inflation, use))
        self._keep(before, ca.logic_or(leak, compliance))

    def _kept(self) -> list[Hypothesis]:
        return [h.copy() for h in self.all]

    def _keep(self, before: list[Hypothesis], unless: Any) -> None:
        """All as it was unless a condition holds: what leads away from it is then a branch that few samples take."""
        for h, old in zip(self.all, before, strict=True):
            h.covariance.replaced(old.covariance, ca.logic_not(unless))
            h.mean = [ca.if_else(unless, new, kept) for new, kept in zip(h.mean, old.mean, strict=True)]
            h.weight = ca.if_else(unless, h.weight, old.weight)

    def measure(
        self,
        place: Any,
        nominal: Any,
        low: Any,
        top: Any,
        variance: Any,
        arrived: Any,
        doubt: Any,
        use: Any,
        by_offset: Any = 0.0,
        seemed: tuple[Sequence[Any], Sequence[Any]] = ((), ()),
        went_on: Any = 0.0,
    ) -> Measured:
        """Take a contact, a reference or an angle.

        Args:
            place: where it is by the description [m].
            nominal: where the nominal position is at it [m].
            low: 1 for a contact at the retracted end.
            top: 1 for a contact at the extended end.
            variance: of its own [m2].
            arrived: variance of the nominal position just there [m2]; the piston is at the place all the same.
            doubt: probability that it is neither an end nor a reference.
            use: whether there is one.
            by_offset: how the place follows the error of the link's angle [m/rad].
            seemed: derivatives of the way that the piston only seemed to go since it came to that nominal position,
                with respect to factors and lag [m, m/s], and the factors and lag that it was made with.
            went_on: whether it went that way all the same, after it had been there.
        """
        row = self._row([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], (-low, -top, by_offset))
        chance = ca.log(doubt / self._stroke)  # of its density, were it anywhere in the stroke
        used, normal, likelihoods = [], [], []
        self._normalise()
        kept = self._kept()
        self._lose(row, place - nominal, variance + arrived, use)
        for h in self.all:
            self._take_back(h, *seemed)
            m = h.mean
            innovation = place + low * m[LOW] + top * m[TOP] - (nominal + m[POSITION])
            if self._with_link:
                innovation = innovation - by_offset * m[OFFSET]
            innovation2 = innovation**2
            own = variance + arrived
            # Beyond the cylinder's ends there is neither an obstacle nor an end that is elsewhere.
            beyond = self._beyond(h, nominal, own)
            elsewhere = chance - 0.5 * beyond
            total = h.covariance.variance(row) + own
            likelihood = _likelihood(ca.fmax(innovation2, beyond * total), total)
            fits = likelihood > elsewhere
            h.covariance.add(POSITION, ca.if_else(fits, arrived, 0.0))
            h.weight = h.weight + ca.fmax(likelihood, elsewhere)
            corrected = [k for k in range(self._size) if k != COMPLIANCE]
            h.correct(h.covariance.update(row, innovation, variance, fits, only=corrected))
            self._take_back(h, [ca.if_else(went_on, -by, 0.0) for by in seemed[0]], seemed[1])
            used.append(fits)
            normal.append(innovation2 / total)
            likelihoods.append(likelihood)
        self._normalise()
        fits = self._together.best(used)
        newest = ca.fmin(self._together.best(normal), _MOST)
        adapt = self._adapt + _ADAPTS * (newest - 1.0 - self._adapt)
        taken = ca.if_else(use, fits, 0.0)
        adapt = ca.if_else(fits, adapt, self._adapt)
        self._graph.becomes("innovations", ca.if_else(use, adapt, self._adapt))
        self._widen(ca.sqrt(newest), fits, use)
        # A reference is never an obstacle.
        doubts = ca.if_else(low + top > 0.0, chance - likelihoods[0], _NEVER)
        self._renew(fits, kept[0], doubts)
        self._together.reweighed(use)
        self._keep(kept, use)
        moved = self._recentre()
        return Measured(taken, ca.logic_and(use, ca.logic_not(taken)), moved)

    def _lose(self, row: list[Any], innovation: Any, own: Any, use: Any) -> None:
        """*Wrong* begins anew where that explains what was met better than what it believes.

        Since the last reference the position may have been lost at any time. What *wrong* took for an end before that
        may have been an obstacle; it does not keep the position from being found again.

        Args:
            row: of the measurement.
            innovation: of it, over the nominal position [m].
            own: its variance [m2].
            use: whether there is one.
        """
        first, wrong = self.all[0], self.all[WRONG]
        believes = wrong.covariance.variance(row) + own
        anew = self._unknown**2 + own
        before = wrong.weight + _likelihood((innovation - wrong.mean[POSITION]) ** 2, believes)
        prior = math.log(self._assumptions.stops.wrong)
        lost = ca.logic_and(use, prior + _likelihood((innovation - first.mean[POSITION]) ** 2, anew) > before)
        wrong.covariance.replaced(first.covariance, lost, std=self._unknown)
        wrong.mean = [ca.if_else(lost, new, old) for new, old in zip(first.mean, wrong.mean, strict=True)]
        wrong.weight = ca.if_else(lost, prior, wrong.weight)

    def _take_back(self, h: Hypothesis, by: Sequence[Any], around: Sequence[Any]) -> None:
        """Take back a way that the piston only seemed to go: what it made unsure, and what it made known."""
        if by:
            h.covariance.predict(self._row([0.0, *(-one for one in by)]), [0.0] * self._size)
            made = zip(by, self._stepped(h), around, strict=True)
            h.mean[POSITION] = h.mean[POSITION] - sum(one * (mine - used) for one, mine, used in made)

    def _widen(self, size: Any, fits: Any, use: Any) -> None:
        """Let references say how wide the band has to be: adaptive conformal inference.

        One outside the band widens it by a step, one inside narrows it by as much as makes five of a hundred outside,
        but never below what the filter says. So a model's error that nobody thought of widens the band as well.

        Args:
            size: of the innovation over its standard deviation [1].
            fits: whether it is one.
            use: whether there may be one at this sample; alone, for it leads into the branch of samples with a contact.

        Source: Gibbs and Candès (2021), Adaptive conformal inference under distribution shift, equation (2), in the
        logarithm of the width.
        """
        outside = size > TWO_SIDED_95 * self._width
        wider = self._width * ca.if_else(outside, math.exp(_STEP * (1.0 - OUTSIDE)), math.exp(-_STEP * OUTSIDE))
        taken = ca.if_else(fits, ca.fmax(wider, 1.0), self._width)
        self._graph.becomes("band_width", ca.if_else(use, taken, self._width))

    def _normalise(self) -> None:
        """The likeliest has the weight 0, and none is out of reach."""
        largest = self._together.largest()
        for h in self.all:
            h.weight = ca.fmax(h.weight - largest, _LEAST)

    def _beyond(self, h: Hypothesis, nominal: Any, own: Any) -> Any:
        """How far a hypothesis is beyond the cylinder's ends, where no piston can be, squared and normalised [1]."""
        position = nominal + h.mean[POSITION]
        outside = ca.fmax(ca.fmax(-position, position - self._stroke), 0.0)
        return outside**2 / (h.covariance[POSITION, POSITION] + own)

    def _renew(self, taken: Any, before: Hypothesis, doubts: Any) -> None:
        """After a reference: what was *wrong* and is likeliest becomes the first; *wrong* begins anew.

        A machine that surely *leaks* otherwise becomes the first as well: its leakage is known by then, as any other's.
        Where the reference may well have been an obstacle, *wrong* is that: the position goes on as it was before it.

        Args:
            taken: whether the likeliest hypothesis used it.
            before: the first hypothesis before the reference.
            doubts: logarithm of the odds, by the first, that it was none.
        """
        first, leaks, wrong = self.all[0], self.all[LEAKS], self.all[WRONG]
        surely = ca.logic_and(self._together.leads(leaks), first.weight < math.log(OUTSIDE))
        taught, found = ca.logic_and(taken, surely), ca.logic_and(taken, self._together.leads(wrong))
        for other, where in ((leaks, taught), (wrong, found)):
            first.covariance.replaced(other.covariance, where)
            first.mean = [ca.if_else(where, b, a) for a, b in zip(first.mean, other.mean, strict=True)]
            first.weight = ca.if_else(where, other.weight, first.weight)
        leaks.weight = ca.if_else(taught, _LEAST, leaks.weight)
        # An end that is elsewhere than described explains a wrong position as well, so that refutes nothing.
        refuted = ca.logic_and(wrong.weight < math.log(0.1), self._together.leads(first))
        anew = ca.logic_or(found, ca.logic_and(taken, refuted))
        perhaps = ca.logic_and(doubts < 0.0, doubts > math.log(OUTSIDE))
        # Of a position that nobody knew there is nothing to go on with.
        perhaps = ca.logic_and(perhaps, before.covariance[POSITION, POSITION] < (0.5 * self._unknown) ** 2)
        doubtful = ca.logic_and(ca.logic_and(anew, ca.logic_not(found)), perhaps)
        wrong.covariance.replaced(first.covariance, anew, std=self._unknown)
        wrong.covariance.replaced(before.covariance, doubtful)
        goes_on = [ca.if_else(doubtful, old, new) for old, new in zip(before.mean, first.mean, strict=True)]
        wrong.mean = [ca.if_else(anew, b, a) for a, b in zip(wrong.mean, goes_on, strict=True)]
        began = ca.if_else(doubtful, first.weight + doubts, math.log(self._assumptions.stops.wrong))
        wrong.weight = ca.if_else(anew, began, wrong.weight)

    def _recentre(self) -> Any:
        """Make the likeliest position the nominal one; by how much that moves it [m]."""
        moved = self._together.best([h.mean[POSITION] for h in self.all])
        for h in self.all:
            h.mean[POSITION] = h.mean[POSITION] - moved
        return moved

    def variance(self) -> Any:
        """Of the position over all hypotheses, about the nominal one [m2] (`Mixture.variance`)."""
        return self._together.variance()

    def band(self) -> Any:
        """Standard deviation of the position [m] whose 1.96-fold holds the truth in 95 of 100 cases, as references say.

        See `Mixture.band`.
        """
        return self._graph.becoming("band_width") * self._together.band()

    def bound(self) -> Any:
        """The error that no more than `mixture.RISK` of the samples exceed [m], as references say (`Mixture.bound`)."""
        return self._graph.becoming("band_width") * self._together.bound()

    def factor_std(self, k: int) -> Any:
        """Standard deviation of a factor under the likeliest hypothesis [1]."""
        return self._together.std([float(k == other) for other in range(self._size)])

    def leak_std(self, by: Sequence[Any]) -> Any:
        """The same of leakage that follows its factor and `WARMER` by these derivatives."""
        return self._together.std(self._row([0.0, by[0], *(0.0 for _ in range(DISPLACEMENT, LOW)), by[1]]))

    def close(self) -> list[Any]:
        """Hand all back to the graph; returns what it is after the sample."""
        for name, h in zip(NAMES, self.all, strict=True):
            h.covariance.limit(self._stroke)
            h.covariance.close()
            for k, value in enumerate(h.mean):
                self._graph.becomes(f"{name}_{k}", value)
            self._graph.becomes(f"{name}_weight", h.weight)
        return [one for h in self.all for one in (*h.mean, *h.covariance.entries.values(), h.weight)]
