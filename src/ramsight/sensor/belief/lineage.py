"""Where each hypothesis after a measurement comes from: births and restarts, followed back by whoever looks back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Flag, Scalar, all_of, any_of, count, flag, holds, scalar
from ramsight.sensor.kind import Kind


@dataclass(frozen=True)
class Parent:
    """The hypothesis before a measurement that one after it continues."""

    place: Scalar  # its place among all of them
    independent: Flag  # whether the position is another one, unknown until then; what is known of the machine goes on


@dataclass(frozen=True)
class Births:
    """What a measurement of the place did to the hypotheses."""

    found: Flag  # whether *unknown position* became the first
    surely: Flag  # whether *leaks* did
    restarts: Flag  # whether *unknown position* begins again
    goes_on: Flag  # whether it does as the first one was before the measurement
    lost: Flag  # whether it began again before the measurement was applied


def parents(kinds: Sequence[Kind], births: Births) -> tuple[Parent, ...]:
    """Of each hypothesis after a measurement."""
    last = len(kinds) - 1
    unknown = Parent(ca.if_else(births.lost, 0.0, float(last)), births.lost)
    leaks = float(kinds.index(Kind.LEAKS)) if Kind.LEAKS in kinds else 0.0
    kept = Parent(ca.if_else(births.surely, leaks, 0.0), flag(False))
    first = _either(births.found, unknown, kept)
    found = [first]
    for place, kind in enumerate(kinds[1:last], start=1):
        own = Parent(scalar(float(place)), flag(False))
        found.append(_either(births.found, unknown, own) if kind in (Kind.LOW, Kind.TOP) else own)
    begun = _either(births.goes_on, Parent(scalar(0.0), flag(False)), Parent(first.place, flag(True)))
    return (*found, _either(births.restarts, begun, unknown))


def unchanged(kinds: Sequence[Kind]) -> tuple[Parent, ...]:
    """Of hypotheses that go on."""
    return tuple(Parent(scalar(float(place)), flag(False)) for place in range(len(kinds)))


def used(where: Flag, births: Sequence[Parent], kinds: Sequence[Kind]) -> tuple[Parent, ...]:
    """Of each hypothesis, where there was a measurement."""
    return tuple(_either(where, one, same) for one, same in zip(births, unchanged(kinds), strict=True))


def followed(first: Sequence[Parent], then: Sequence[Parent]) -> tuple[Parent, ...]:
    """Of each hypothesis after two measurements."""
    found = []
    for one in then:
        before = first[0]
        for place, other in enumerate(first):
            before = _either(holds(count(one.place == float(place))), other, before)
        found.append(Parent(before.place, any_of(before.independent, one.independent)))
    return tuple(found)


def _either(condition: Flag, one: Parent, other: Parent) -> Parent:
    """One of two."""
    independent = any_of(all_of(condition, one.independent), all_of(ca.logic_not(condition), other.independent))
    return Parent(ca.if_else(condition, one.place, other.place), independent)
