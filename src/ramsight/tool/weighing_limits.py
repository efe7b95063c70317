"""Numbers that decide of a weighing, each with its unit and reason."""

from __future__ import annotations

from ramsight.constant import Constant

MOVING = Constant(4e-3, "1/s", "stroke a second from which on a rod moves: below it friction may be of either sign")
BRIDGED = Constant(0.1, "s", "a pause of some samples does not end a lift")
SETTLES = Constant(0.8, "s", "after the start of a motion: valves open, pressures and the load observer settle")
SLOWS = Constant(0.4, "s", "before the end of a motion: the reported speed is behind the torque")
SHORTEST = Constant(1.5, "s", "of steady motion: three blocks, which show a change")
BLOCK = Constant(0.5, "s", "over which masses are averaged to see them change: longer than a stroke of the pumps")
STEADY = Constant(0.01, "1", "force of acceleration over weight up to which motion is steady: a third of a usual ramp")
SPEED_VARIES = Constant(0.1, "1", "standard deviation of the speed over its mean from which on a lift is not steady")
STEADY_SHARE = Constant(0.7, "1", "of the time in motion that has to be steady")
CHANGES = Constant(0.02, "1", "rated payload by which the mass may change within a weighing: as it is asked for")
NOISE_STDS = Constant(3.0, "1", "standard deviations of a block's noise that are no change")
ONE_STEP = Constant(0.75, "1", "share of a change's variance that one step down explains: it was spilled, not dug")
POSITION_SHARE = Constant(0.03, "1", "rated payload; a larger deviation by the positions is no known position")
BODIES_STD = Constant(0.02, "1", "of the weight of bodies without payload: mud, oil and what a drawing leaves out")
LOSSES_STD = Constant(0.012, "1", "of a force, by pumps: a tenth of the losses at a hydromechanical efficiency of 0.89")
DRIFT_STD = Constant(5e-3, "1", "of the torque's gain as magnets warm up: 0.11 %/K over 5 K that drives do not see")
OFFSET_STD = Constant(2.5e-3, "1", "of a torque over that at relief pressure: offset of current sensors")
FRICTION_STD = Constant(0.25, "1", "of the cylinder's friction: ± 40 %, by seals, their age and lubrication")
INCLINATION_STD = Constant(0.0087, "rad", "of a machine's declared inclination: half a degree of a spirit level")
REPEATS_STD = Constant(1.2e-3, "1", "of a force, new with each lift: oil temperature and pressure losses differ")
PAIR_STDS = Constant(3.0, "1", "deviations of friction within which up and down are of one load")
STANDS_STILL = Constant(0.02, "1", "stroke by which other units may move between up and down of one load")
NEAR_FROM = Constant(0.05, "1", "probability of an exceeded rated load from which it is near: one end of a 90 % band")
EXCEEDED_FROM = Constant(0.5, "1", "probability from which the rated load is exceeded: more likely than not")
EMPTY_SHARE = Constant(0.03, "1", "rated payload below which a lift counts as of an empty tool")
KNOWN_STD = Constant(5e-3, "1", "of a known mass: a weighbridge of class IV, its steps over the mass")
SUMMED = Constant(
    0.1, "s", "of samples whose sums are kept: acceleration is of the velocities of those before and after"
)
LARGEST = Constant(1e12, "1", "no quantity is larger: beyond it is what is not known")
CLOCK_BACK = Constant(1.0, "s", "a clock that goes back by more has begun again; by less a sample came late")
