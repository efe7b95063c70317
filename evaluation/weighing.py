"""How well a loader weighs: lifts of machines drawn within their tolerances, by the boom's drive alone.

Machines are drawn as for a data sheet (leakage, displacement, losses and friction, stiffness, areas, torque gain,
offset, drift and delay, thermometer), the weight of every body within ± 3 %, the ground within half a degree. Each lift
is a log of its own: a mass, a speed and an oil temperature drawn at random, the bucket held by its cylinder and
declared to be level. The scale is learned from one known mass, or from ten lifts of an empty and ten of a full bucket
of known mass. Bad lifts move too fast, dig, or spill. The seed decides everything.

Rated loads are put from three standard deviations below to three above what each good lift carried, at its true reach
and slope. Of the lifts with a status as many have to exceed the rated load as their probabilities state.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any

import numpy as np

from ramsight import machine
from ramsight.duty.linked_duty import LinkedDuty, simulate_linked, unit_run
from ramsight.duty.profile import Profile, constant
from ramsight.machine.spread import Spread
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.plant.linkage import Mechanism
from ramsight.plant.linkage.members import Body
from ramsight.plant.linked import LinkedMachine, build_linked
from ramsight.sensor.kalman import kalman
from ramsight.signals import Signal, Signals
from ramsight.study.datasheet.drawn import Drawn, draw, ready
from ramsight.study.datasheet.quantities import varied
from ramsight.tool import weighing_limits as limit
from ramsight.tool.force_scale import Scale, described_scale
from ramsight.tool.load_chart import LoadChart, LoadStatus, RatedLoad
from ramsight.tool.unit_tracks import Others, Rods
from ramsight.tool.weigher import lifts
from ramsight.tool.weighing_events import Plain, Quality, Scene, Weighing
from ramsight.tool.weighing_tally import Tally, weighed
from ramsight.units import RPM

NAME = "mining-loader"
UNIT, OTHER = "boom", "bucket"
MACHINES, LIFTS, BAD, TAUGHT = 20, 10, 4, 10
"""Machines; of each: good lifts, bad lifts of a kind, lifts of an empty and of a full bucket to learn from."""
KINDS = ("too_fast", "digging", "spilled")
LEVEL = 0.25  # m, of the bucket's cylinder
KNOWN_STD = 10.0  # kg, of a mass from a weighbridge
BODIES = 0.03  # of the weight of a body
GROUNDS = 4  # of a machine's lifts
TILT_STD = math.radians(0.5)  # of the ground that a lift is on
RUNGS = np.linspace(-3.0, 3.0, 24)
"""Standard deviations by which a lift is above the rated load."""
Random = np.random.Generator


@cache
def described() -> LinkedMachine:
    """The loader as described."""
    return build_linked(machine.load_machine(NAME))


@cache
def scene() -> Scene:
    """What a lift is weighed with."""
    linkage = machine.load_machine(NAME).linkage
    assert linkage is not None, "a loader has a mechanism"
    return Scene(described(), UNIT, Others(held={OTHER: LEVEL}), chart=LoadChart.of(linkage))


def value_of(spread: Spread, random: Random) -> float:
    """A value within a tolerance."""
    low, high = spread.ends
    if spread.distribution == "uniform":
        return float(random.uniform(low, high))
    deviation = float(random.standard_normal())
    if spread.distribution == "log-normal":
        return float(np.clip(spread.centre * math.exp(spread.std / spread.centre * deviation), low, high))
    return float(np.clip(spread.centre + spread.std * deviation, low, high))


@dataclass(frozen=True)
class Made:
    """A machine within its tolerances."""

    grounds: tuple[LinkedMachine, ...]  # its units and its mechanism, as they are, on grounds of different slopes
    bodies: tuple[Body, ...]  # those of its mechanism
    drawn: Mapping[str, Drawn]  # the units, with what their drives are off by
    temperature: float  # of its oil [K]
    slopes: tuple[float, ...]  # of the grounds [rad]


def made(seed: int) -> Made:
    """A machine."""
    random = np.random.default_rng([seed, 7])
    loader = machine.load_machine(NAME)
    units = {}
    for name in (UNIT, OTHER):
        values = {one.name: value_of(one.spread, random) for one in varied(loader, name)}
        sheet = ready(build(loader.unit(name), name))
        units[name] = draw(loader.unit(name), name, sheet, values)
    plain = described().mechanism
    bodies = tuple(replace(body, mass=body.mass * random.uniform(1 - BODIES, 1 + BODIES)) for body in plain.bodies)
    slopes = TILT_STD * random.standard_normal(GROUNDS)
    grounds = (tilt(replace(plain, bodies=bodies), float(slope)) for slope in slopes)
    built = tuple(one.unit for one in units.values())
    return Made(
        tuple(LinkedMachine(NAME, built, ground) for ground in grounds),
        bodies,
        units,
        units[UNIT].values["oil_temperature"],
        tuple(map(float, slopes)),
    )


def tilt(mechanism: Mechanism, angle: float) -> Mechanism:
    """A mechanism whose machine's front is higher by an angle [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)

    def turned(part: Any) -> Any:
        names = [one.name for one in fields(part)]
        pairs = [(name, name[:-1] + "z") for name in names if name == "x" or name.endswith("_x")]
        changes = {}
        for x, z in pairs:
            here = getattr(part, x), getattr(part, z)
            changes |= {x: cosine * here[0] - sine * here[1], z: sine * here[0] + cosine * here[1]}
        return replace(part, **changes)

    return replace(
        mechanism,
        bodies=tuple(turned(one) for one in mechanism.bodies),
        struts=tuple(turned(one) for one in mechanism.struts),
        tip=turned(mechanism.tip),
        load=turned(mechanism.load),
    )


@dataclass(frozen=True)
class Course:
    """What happens in a lift: the boom's speed, and masses and forces over the time from the start of its motion."""

    speed: Sequence[tuple[float, float]]
    mass: Sequence[tuple[float, float]]
    force: Sequence[tuple[float, float, float]] = ((0.0, 0.0, 0.0),)

    @property
    def duration(self) -> float:
        """Of the motion [s]."""
        return self.speed[-1][0]


def steady(mass: float, random: Random) -> Course:
    """A lift at one speed."""
    top = random.uniform(1200.0, 2800.0) * RPM
    ramp, hold = random.uniform(0.3, 0.8), random.uniform(4.0, 8.0)
    return Course(((0.0, 0.0), (ramp, top), (ramp + hold, top), (2 * ramp + hold, 0.0)), ((0.0, mass),))


def too_fast(mass: float, random: Random) -> Course:
    """A jerk at full speed, or a joystick that changes every 0.25 to 0.6 s."""
    if random.random() < 0.5:
        top, ramp, hold = random.uniform(3000.0, 3900.0) * RPM, random.uniform(0.1, 0.3), random.uniform(0.5, 2.0)
        return Course(((0.0, 0.0), (ramp, top), (ramp + hold, top), (2 * ramp + hold, 0.0)), ((0.0, mass),))
    times = np.cumsum(random.uniform(0.25, 0.6, 12))
    speeds = random.uniform(0.2, 1.0, 12) * 3000.0 * RPM
    return Course(((0.0, 0.0), *zip(times, speeds, strict=True), (times[-1] + 0.3, 0.0)), ((0.0, mass),))


def digging(mass: float, random: Random) -> Course:
    """The heap holds the lip for 40 to 100 % of the lift, and breaks every 0.2 to 0.8 s, while the bucket fills."""
    course = steady(mass, random)
    ends = random.uniform(0.4, 1.0) * course.duration
    times = np.arange(0.0, ends, random.uniform(0.2, 0.8))
    down, back = random.uniform(5e3, 30e3), random.uniform(10e3, 40e3)
    pulls = random.uniform(0.2, 1.0, (len(times), 2))
    force = [(t, -back * a, -down * b) for t, (a, b) in zip(times, pulls, strict=True)]
    filled = ((0.0, random.uniform(0.3, 0.9) * mass), (ends, mass))
    return replace(course, mass=filled, force=(*force, (ends + 0.2, 0.0, 0.0)))


def spilled(mass: float, random: Random) -> Course:
    """Five to forty per cent of the rated mass falls within 0.1 to 0.5 s, between a quarter and three of the lift."""
    course = steady(mass, random)
    rated = described().mechanism.rated_payload
    at = random.uniform(0.25, 0.75) * course.duration
    left = max(mass - random.uniform(0.05, 0.4) * rated, 0.0)
    return replace(course, mass=((0.0, mass), (at, mass), (at + random.uniform(0.1, 0.5), left)))


COURSES: dict[str, Callable[[float, Random], Course]] = {
    "good": steady, "too_fast": too_fast, "digging": digging, "spilled": spilled,
}  # fmt: skip


@dataclass(frozen=True)
class Lifted:
    """A lift by the boom's log, and what it was."""

    plain: Plain  # by the described machine
    mass: float  # at the end [kg]
    moment: float  # largest load moment of a kilogram over the rated one, at the true reach [1/kg]


def lifted(one: Made, course: Course, random: Random, seed: int) -> Lifted:
    """A lift; the empty bucket is lowered after it."""
    ground = int(random.integers(len(one.grounds)))
    tilted = one.grounds[ground]
    begins, loads = 2.5, 1.0
    dumps = begins + course.duration + 1.0
    lowers = dumps + 1.5
    back = [(lowers + t, -0.95 * v) for t, v in course.speed]
    speed = [(0.0, 0.0), *((begins + t, v) for t, v in course.speed), *back]
    mass = [(0.0, 0.0), (loads, 0.0), (begins - 0.5, course.mass[0][1])]
    mass += [(begins + t, m) for t, m in course.mass if t > 0.0]
    mass += [(dumps, course.mass[-1][1]), (dumps + 0.7, 0.0)]
    force = [(begins + t, x, z) for t, x, z in course.force]
    kelvin = one.temperature + random.uniform(-4.0, 4.0)
    starts = {UNIT: random.uniform(0.08, 0.2), OTHER: LEVEL}
    places = [Profile([t for t, *_ in force], [row[k] for row in force]) for k in (1, 2)]
    duty = LinkedDuty(
        {UNIT: Profile(*np.array(speed).T), OTHER: constant(0.0)},
        dict.fromkeys(starts, constant(kelvin)), starts, Profile(*np.array(mass).T), *places,
        end=speed[-1][0] + 0.5,
    )  # fmt: skip
    both = simulate_linked(tilted, duty)
    run = unit_run(both, UNIT)
    time = run["time"].values
    reported = one.drawn[UNIT].reported(time, run["motor_speed"].values, run["motor_torque"].values,
                                  run["oil_temperature"].values, seed)  # fmt: skip
    names = ("motor_speed", "motor_torque", "oil_temperature")
    log = Signals({"time": Signal(time), **{n: Signal(v) for n, v in zip(names, reported, strict=True)}})
    sensor = _sensor()
    sensor.start(starts[UNIT] + 1e-3 * float(np.clip(random.standard_normal(), -3, 3)), 1e-3)
    raised = (time >= begins) & (time <= begins + course.duration)
    true = np.column_stack([both[f"{name}_position"].values[raised] for name in (UNIT, OTHER)])
    chart = scene().chart
    assert chart is not None, "the loader has one"
    moments, _ = chart.shares(described().mechanism, true, one.slopes[ground])
    plain = lifts(scene(), sensor.followed(log))[0]
    return Lifted(plain, course.mass[-1][1], float(moments.max()))


@cache
def _sensor() -> Any:
    return kalman(described().unit(UNIT))


def learned(scale: Scale, found: Sequence[Lifted]) -> Scale:
    """A scale after lifts of known masses; bad ones teach nothing."""
    for one in found:
        plain = one.plain
        if plain.quality is Quality.GOOD:
            scale = scale.learned(plain.mass, plain.row, one.mass, math.hypot(plain.own_std, KNOWN_STD))
    return scale


@dataclass(frozen=True)
class Judged:
    """A good lift by a scale: error and deviation over the rated payload."""

    error: float
    std: float
    ratings: tuple[tuple[RatedLoad, bool], ...]  # by rated loads near what it carried, and whether it exceeded them


def judged(found: Sequence[Lifted], scale: Scale) -> list[Judged]:
    """Good weighings against the truth."""
    rated = described().mechanism.rated_payload
    rows = []
    for one in found:
        (weighing,) = weighed([one.plain], Tally(scale, np.zeros(1)))
        if weighing.is_good:
            ratings = tuple(rated_as(weighing, one.mass * one.moment))
            rows.append(Judged((weighing.mass - one.mass) / rated, weighing.std / rated, ratings))
    return rows


def rated_as(weighing: Weighing, true: float) -> Iterator[tuple[RatedLoad, bool]]:
    """What is stated of a lift by charts whose rated loads are near what it carried, and whether it exceeded them."""
    share, std = weighing.rated_share, weighing.rated_share_std
    for rung in RUNGS:
        factor = (1.0 + rung * std / share) / true  # the described chart's rated loads over this one's
        yield RatedLoad.of(share * factor, std * factor), bool(rung > 0.0)


def of_machine(seed: int) -> dict[str, Any]:
    """All lifts of a machine: judged by each scale, and what was said of bad ones."""
    random, one = np.random.default_rng([seed, 11]), made(seed)
    rated = described().mechanism.rated_payload

    def lift(kind: str, mass: float, number: int) -> Lifted:
        return lifted(one, COURSES[kind](mass, random), random, 1000 * seed + number)

    tested = [lift("good", m, k) for k, m in enumerate(random.uniform(0.1, 1.0, LIFTS) * rated)]
    known = [lift("good", SHARE * rated, 100)]
    taught = [lift("good", m, 200 + k) for k, m in enumerate([0.0, 0.9 * rated] * TAUGHT)]
    described_as = described_scale(described().unit(UNIT), scene().weight)
    scales = {"uncalibrated": described_as, "one_mass": learned(described_as, known),
              "empty": learned(described_as, taught[::2]), "empty_and_full": learned(described_as, taught)}  # fmt: skip
    bad = {}
    for kind in KINDS:
        masses = random.uniform(0.4, 1.0, BAD) * rated
        bad[kind] = [lift(kind, m, 300 + k).plain.quality for k, m in enumerate(masses)]
    return {
        "lifts": {name: judged(tested, scale) for name, scale in scales.items()},
        "called_bad": [
            one.plain.quality for one in (*tested, *known, *taught) if one.plain.quality is not Quality.GOOD
        ],
        "good": len(tested) + len(known) + len(taught),
        "bad": bad,
    }


SCALES = {
    "uncalibrated": "by the description alone",
    "one_mass": "after one known mass",
    "empty": "after ten lifts of the empty bucket",
    "empty_and_full": "after ten lifts of the empty and ten of the full bucket",
}


SHARE = 0.7  # of the rated payload, of the error budget and of the one known mass
_POSITION = 2e-3  # m


def budget() -> dict[str, float]:
    """Deviations of one weighing at a quarter of the stroke over the rated payload, by cause."""
    unit, rated, still = described().unit(UNIT), scene().rated, np.zeros((1, 2))
    place = np.array([[0.25 * unit.cylinder.stroke, LEVEL]])

    def force(moved: np.ndarray, tilted: float = 0.0) -> tuple[float, float]:
        found = scene().balance(Rods(moved, still, still), still, tilted)
        return float(found.bodies[0]), float(found.payload[0])

    bodies, payload = force(place)
    carried = bodies + SHARE * rated * payload
    moved, tilted = force(place + np.array([[_POSITION, 0.0]])), force(place, limit.INCLINATION_STD)
    row = np.array([carried, carried, 1.0, 1.0]) / payload
    alone = described_scale(unit, scene().weight)
    own = math.hypot(KNOWN_STD, limit.REPEATS_STD * carried / payload)
    after = alone.learned(0.0, row, 0.0, own)
    causes = {
        "gain of the torque": unit.assumptions.drive.torque_gain * carried,
        "its drift as magnets warm up": limit.DRIFT_STD * carried,
        "displacement of the pumps, by leakage and wear": unit.assumptions.machine.displacement * carried,
        "losses of the pumps, with the oil's temperature": limit.LOSSES_STD * carried,
        "offset of the torque": limit.OFFSET_STD * limits_of(unit).load,
        "weight of boom and bucket": limit.BODIES_STD * scene().weight,
        "friction of the cylinders": limit.FRICTION_STD * unit.cylinder.coulomb_friction,
        "lever, by 2 mm of the position": abs(carried - moved[0] - SHARE * rated * moved[1]),
        "slope, half a degree": abs(carried - tilted[0] - SHARE * rated * tilted[1]),
        "what no lift repeats": limit.REPEATS_STD * carried,
    }
    found = {name: value / payload / rated for name, value in causes.items()}
    found["all, by the description alone"] = math.hypot(*found.values())
    shared = alone.mass(0.0, row)[1], after.mass(0.0, row)[1]
    own_part = math.sqrt(max(found["all, by the description alone"] ** 2 - (shared[0] / rated) ** 2, 0.0))
    found["all, after one known mass like it"] = math.hypot(shared[1] / rated, own_part)
    return found


def budget_table(found: dict[str, Any]) -> list[str]:
    """A cause a row."""
    rows = ["| cause | standard deviation over the rated load |", "|---|---|"]
    return rows + [f"| {name} | {100 * value:.2f} % |" for name, value in found["budget"].items()]


def runs() -> int:
    """How many machines there are."""
    return MACHINES


def study(advance: Callable[[int], object]) -> dict[str, Any]:
    """Figures by scale, and of bad lifts."""
    machines = []
    for seed in range(MACHINES):
        machines.append(of_machine(seed))
        advance(1)
    found: dict[str, Any] = {"scales": {}, "bad": {}}
    for name in SCALES:
        rows = [row for one in machines for row in one["lifts"][name]]
        error, std = np.array([row.error for row in rows]), np.array([row.std for row in rows])
        found["scales"][name] = {
            "lifts": len(rows),
            "p95": float(np.quantile(np.abs(error), 0.95)),
            "bias": float(error.mean()),
            "coverage": float(np.mean(np.abs(error) <= TWO_SIDED_95 * std)),
            "band": float(TWO_SIDED_95 * np.median(std)),
            "rated": ratings([one for row in rows for one in row.ratings]),
        }
    for kind in KINDS:
        said = [quality for one in machines for quality in one["bad"][kind]]
        found["bad"][kind] = {"lifts": len(said), "called_good": sum(one is Quality.GOOD for one in said)}
    found["budget"] = budget()
    found["good"] = sum(one["good"] for one in machines)
    found["good_called_bad"] = sum(len(one["called_bad"]) for one in machines)
    return found


def ratings(rows: Sequence[tuple[RatedLoad, bool]]) -> dict[str, dict[str, float]]:
    """By status: how many there are, the mean of their stated probabilities, and how many did exceed."""
    found = {}
    for status in (LoadStatus.WITHIN, LoadStatus.NEAR, LoadStatus.EXCEEDED):
        of = [(one.exceeded, did) for one, did in rows if one.status is status]
        stated, was = np.array(of).T
        found[status.name.lower()] = {"cases": len(of), "stated": float(stated.mean()), "was": float(was.mean())}
    return found


def rating_table(found: dict[str, Any]) -> list[str]:
    """A scale a row: of each status what was stated and what was."""
    statuses = [status.name.lower() for status in LoadStatus][:3]
    rows = [f"| scale | {' | '.join(f'*{one}*: stated, exceeded' for one in statuses)} |", "|---" * 4 + "|"]
    for name, row in found["scales"].items():
        of = [row["rated"][one] for one in statuses]
        cells = [f"{100 * one['stated']:.1f} %, {100 * one['was']:.1f} %" for one in of]
        rows.append(f"| {SCALES[name]} | {' | '.join(cells)} |")
    return rows


def tables(found: dict[str, Any]) -> dict[str, list[str]]:
    """For the page, by their marks."""
    return {
        "weighing": table(found), "weighing_bad": bad_lifts(found), "weighing_budget": budget_table(found),
        "weighing_rated": rating_table(found),
    }  # fmt: skip


def table(found: dict[str, Any]) -> list[str]:
    """A scale a row."""
    rows = ["| scale | lifts | 95 % error | bias | band holds | band, median |", "|---" * 6 + "|"]
    return rows + [
        f"| {SCALES[name]} | {row['lifts']} | {100 * row['p95']:.2f} % | {100 * row['bias']:+.2f} % "
        f"| {100 * row['coverage']:.0f} % | ± {100 * row['band']:.2f} % |"
        for name, row in found["scales"].items()
    ]


def bad_lifts(found: dict[str, Any]) -> list[str]:
    """What was said of bad lifts, in a sentence."""
    lifts_of = sum(row["lifts"] for row in found["bad"].values())
    good = sum(row["called_good"] for row in found["bad"].values())
    return [
        f"Of {lifts_of} bad lifts (too fast, digging, spilled), {good} were called good; of {found['good']} good ones, "
        f"{found['good_called_bad']} were called bad."
    ]
