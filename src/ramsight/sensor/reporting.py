"""What the self-calibrating sensor says of a sample: position, how sure it is, status, and what it has learned."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.plant.balance import FACTORS
from ramsight.sensor.contact import Contact
from ramsight.sensor.hypothesis import LEAK, LOW
from ramsight.sensor.judgement import judge
from ramsight.sensor.load import LoadStep
from ramsight.sensor.mixture import CERTAIN
from ramsight.sensor.resting import unseen_load
from ramsight.sensor.stages import Met, Parts, Stepped, Updated
from ramsight.sensor.virtual_sensor import BOUND, REFERENCED_NOW, SensorGraph, VirtualSensor

_VELOCITY_SMOOTHING = 0.1  # s
_FASTEST = 1.1  # share of the velocity at the highest motor speed that no correction exceeds


def report(parts: Parts, stepped: Stepped, met: Met, updated: Updated) -> VirtualSensor:
    """How sure the position is, and the status; with them the graph is closed."""
    graph, bank, step, contact = parts.graph, parts.bank, stepped.step, met.contact
    # What only resists moves nothing at rest, however it changes.
    unmoved = 1.0 if parts.unit.cylinder.passive else contact.held
    furthest = ca.fmax(parts.symbol("relief_load") - step.load, step.load + parts.symbol("relief_pull"))
    unseen = unseen_load(graph, step, unmoved, met.usual, furthest)
    # What the stop carries is not known while it is held: some of what the oil does, or what it did before.
    into = ca.if_else(contact.held, step.carried / parts.symbol("stop_stiffness"), 0.0)
    into = ca.fmax(ca.fabs(into), ca.if_else(contact.held, ca.fabs(contact.given_way), 0.0))
    gives = step.give * stepped.checks.torque_off / parts.symbol("travel_per_radian")
    others = into**2 + contact.unsure**2 + step.noise_travel**2 + gives**2
    seen = unseen.std**2 + others
    std = ca.sqrt(bank.band() ** 2 + seen) + updated.pending
    settled = graph.said
    code = judge(
        graph,
        parts.intake,
        step,
        contact,
        updated.relief,
        parts.limits,
        std=std,
        overall=ca.sqrt(ca.fmax(updated.variance, 0.0) + seen) + updated.pending,
        position=updated.position,
        stroke=parts.symbol("stroke"),
        disputed=updated.disputed,
        known=updated.known,
        checks=stepped.checks,
        fault_passed=updated.fault_passed,
    )
    more: dict[str, tuple[Any, str]] = {}
    for k, name in enumerate(FACTORS):
        more[f"{name}_factor"] = updated.after[k], "1"
        more[f"{name}_factor_std"] = bank.factor_std(k + LEAK), "1"
    for warmer in updated.after[LOW - LEAK :]:  # what leaks by the reported temperature, be it the oil's or not
        leak, by = parts.leaking.at_reported(updated.after[0], warmer)
        more |= {"leak_factor": (leak, "1"), "leak_factor_std": (bank.leak_std(by), "1")}
    more |= {f"{name}_probability": (chance, "1") for name, chance in bank.probabilities().items()}
    title = "Update: the filters of what is not known of machine and ends, by torque, contact or reference"
    graph.section(title, settled, bank.close(), updated.position)
    bound = ca.sqrt(bank.bound() ** 2 + unseen.most**2 + CERTAIN**2 * others) + CERTAIN * updated.pending
    since = ca.fmax(graph.state(REFERENCED_NOW), updated.measured.taken)
    graph.becomes(REFERENCED_NOW, since)
    shown, astray = _shown(parts, updated)
    velocity = _velocity(graph, step, contact)
    first = parts.circuit.chambers(step.z)
    first |= {BOUND: (bound + astray, "m"), REFERENCED_NOW: (since, "1"), **stepped.checks.more}
    more = {**first, **more, "mode": (contact.mode, "1")}
    return graph.sensor(
        "kalman", position=shown, velocity=velocity, load=step.load, std=std + astray, status=code, more=more
    )


def _shown(parts: Parts, updated: Updated) -> tuple[Any, Any]:
    """The position that is shown, and how far it may be from the one that is meant [m].

    Whatever is not a reference moves it no faster than the piston can go.
    """
    graph, intake, stroke = parts.graph, parts.intake, parts.symbol("stroke")
    inside = ca.fmin(ca.fmax(updated.position, -stroke), 2.0 * stroke)
    graph.becomes("position", inside)
    shown, started = graph.state("shown_position"), graph.held("started")
    fastest = _FASTEST * parts.symbol("travel_per_radian") * parts.symbol("max_speed")
    reach = fastest * intake.passed
    wanted = ca.fmin(ca.fmax(ca.if_else(intake.usable, inside, graph.position), 0.0), stroke)
    jumps = ca.logic_and(ca.logic_or(updated.measured.taken, ca.logic_not(started)), intake.usable)
    followed = ca.fmin(ca.fmax(wanted, shown - reach), shown + reach)
    now = ca.if_else(jumps, wanted, ca.if_else(started, followed, wanted))
    graph.becomes("shown_position", now, always=True)
    return now, intake.unseen + ca.fabs(wanted - now)


def _velocity(graph: SensorGraph, step: LoadStep, contact: Contact) -> Any:
    """The piston's velocity, smoothed [m/s]."""
    speed, dt = graph.state("velocity"), graph.elapsed
    moving = ca.if_else(contact.held, 0.0, step.travel / ca.fmax(dt, 1e-6))
    velocity = speed + dt / (_VELOCITY_SMOOTHING + dt) * (moving - speed)
    graph.becomes("velocity", velocity)
    return velocity
