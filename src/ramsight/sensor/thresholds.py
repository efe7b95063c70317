"""Every number by which a sensor decides, once: its value, its unit, and where it comes from.

A reason is a declared noise, a stated probability, a law, or a source. Where a number is a choice, the reason has what
lies on either side of it; docs/reference/sensitivity.md has what each does, times and over 1.5.
"""

from __future__ import annotations

import math
from statistics import NormalDist

from ramsight.constant import Constant

# What several of them share.
SURE_STDS = Constant(4.0, "1", "standard deviations that noise exceeds once in 16000 samples")
LIKELY_STDS = Constant(3.5, "1", "standard deviations that a normal error exceeds once in 2000 cases")
USUAL_STDS = Constant(2.0, "1", "standard deviations within which 95 % of what is usual lies")
TINY = Constant(1e-9, "1", "keeps quotients and logarithms finite, in any unit")
NOISE_AVERAGED = Constant(0.1, "s", "averages the noise of five usual samples")
END_GIVES = Constant(5e-3, "1", "share of the stroke: ends give way and are described to about that")
EFFICIENCY_STD = Constant(
    0.03, "1", "of a torque: catalogues round the pumps' hydromechanical efficiency to 0.02 or 0.03"
)
LATEST = Constant(1.0 / 6.0, "1", "share of the newest value in a mean of 2/share - 1 = 11 values")
BETWEEN_STD = Constant(0.5, "1", "where anything between none and all may be: at most, if it is all or none")
HALF = Constant(0.5, "1", "the nearer of two: more than half of a load shows it, below half an alarm ends")
LAG_STD = 1.0 / math.sqrt(3.0)
"""Of a lag that is unknown, over its mean: uniform between none and twice."""
VALVE_SETTLED = Constant(0.5, "s", "valves close, manifolds fill and drives release a torque within half of it")
LOAD_FOUND_TIME = Constant(
    0.3, "s", "after the motor starts or stops: the valve opens and the manifold fills within it"
)
STOOD_STILL = Constant(0.2, "s", "of standstill before a start: the valve has closed and the manifold has leaked empty")

# The motor stands: what is unknown then, and what is unknown while it hardly turns.
MOTOR_TURNS = Constant(
    1.0, "rad/s", "10 rpm: slower, the sign of the pumps' friction is unknown and a safety valve stays closed"
)
MIXED_FRICTION_SPEED = Constant(
    5.0,
    "rad/s",
    "50 rpm: slower, friction is mixed and falls with speed (Stribeck), and makes up most of torque and power",
)

# Input check: time.
NUMBER_LIMIT = Constant(1e12, "1", "larger than any quantity of a drive in SI units; not-a-number fails the comparison")
MEASURABLE_LIMIT = Constant(
    1e9,
    "1",
    "larger than any angle, power, pressure or position in SI units; 1e10 stands for what is not measured",
)
SAMPLE = Constant(0.02, "s", "usual period of a drive's cyclic report, 50 Hz")
USUAL_PERIOD = Constant(0.1, "s", "slowest usual rate of a drive's cyclic report, 10 Hz")
GAP_PERIOD = 1.5 * USUAL_PERIOD
"""Of samples one of which is missing [s]."""
SHORTEST_PERIOD = Constant(8e-3, "s", "chamber pressures settle in about 10 ms; closer samples resolve the transient")
SHORTEST_STEP = Constant(1e-3, "s", "least time step: solved where no time passed, when its result is not used")
BRIDGED_GAP = Constant(0.5, "s", "within it a motor can start and stop; a longer gap cannot be integrated")
LATE_IN_ORDER = Constant(
    1.5, "1", "late samples in a row in their order: a bus swaps two, a clock that was set brings all"
)
RATE_MEMORY = Constant(
    100.0, "1", "samples in which a deviation from the learned period fades; it finds 1 % of it in jitter"
)
RATE_LEARNT = Constant(20.0, "1", "samples whose mean is a period: the ends of 20 periods are off by a tenth of one")
RATE_LEARNT_MOST = Constant(1000.0, "1", "samples after which another period is a new one: 20 s of a usual drive")
LONGEST_GAP = Constant(3600.0, "s", "the motor drives any cylinder through its stroke within an hour")
UNSEEN_SPEED_SHARE = Constant(
    0.02,
    "1",
    "share of the highest speed a motor may have had between two samples of 0; a choice of the size of a nudge",
)

# Input check: values.
LIMIT_SHARE = Constant(
    1.5, "1", "over the largest speed, torque or command, that no drive exceeds; drives trip at 1.1 to 1.3"
)
OVERSPEED_SHARE = Constant(1.05, "1", "share of the highest speed; drives overshoot by up to 5 %")
TEMPERATURE_LOWEST = Constant(203.15, "K", "-70 degC: no mineral oil flows below")
TEMPERATURE_HIGHEST = Constant(423.15, "K", "150 degC: seals and oil are destroyed above")
MAGNETS_HOTTEST = Constant(523.15, "K", "250 degC: windings of insulation class N and magnets are destroyed above")
WALTHER_LOWEST = Constant(243.15, "K", "-30 degC: where the Walther equation joins two points within its tolerance")
WALTHER_HIGHEST = Constant(383.15, "K", "110 degC: where the Walther equation joins two points within its tolerance")
OIL_TIME_CONSTANT = Constant(5.0, "s", "faster changes of a thermometer are its noise; a tank of oil changes slower")
KELVIN = Constant(1.0, "K", "noise of a thermometer; less changes a leakage or a magnet by less than their noise")
TEMPERATURE_STEP = Constant(10.0, "K", "twice what oil changes by within a minute of full relief")
THERMOMETER_STEP = Constant(0.1, "K", "the finest that drives report; J1939 reports whole kelvins")
THERMOMETER_STANDS = Constant(300.0, "s/K", "oil at work changes faster: by 0.2 K in a minute")
UNKNOWN_WARMING = TEMPERATURE_STEP / 8.0 / math.sqrt(60.0)  # K/sqrt(s); 95 % within half of what full relief makes
HABIT_GAIN = Constant(0.005, "1", "share of the newest sample: the habit of changing is that of the last 200 samples")
HABIT_LEAST = Constant(0.8, "1", "a torque with noise of half its step changes in more than 0.8 of the samples")
REPEATS_LEARNT = Constant(3.0, "1", "repeats in a row from which on a stuck torque no longer teaches its habit")
TORQUE_STEP_SHARE = Constant(0.45, "1", "share of the torque at relief pressure; 0.27 is the most in recorded days")
RUNNING_SHARE = Constant(0.03, "1", "share of the highest speed; slower, a load is taken up within a sample")
BLIND_PRESSURE_SHARE = Constant(
    0.3, "1", "share of the relief pressure by which pressure may change unseen (loads of work days)"
)
PRESSURE_BELOW = Constant(0.05, "1", "of relief pressure: zero errors and noise of a sensor read as far below vacuum")
PRESSURE_ABOVE = Constant(0.15, "1", "of relief pressure: by which valves that open, and loads, exceed their setting")
IMPOSSIBLE_LOAD = 1.0 + 2.0 * PRESSURE_ABOVE
"""Over the relief load: the valve opens at 1, with its override twice, once for friction."""
CASE_WARMER_MOST = Constant(60.0, "K", "a pump case that is further from its tank burns its oil")
SMOOTHING_TIME = Constant(20.0, "s", "noise of 0.2 K is averaged away; oil warms by less than a kelvin meanwhile")

# Reports held against each other.
MEMORY_TIME = Constant(
    1.0, "s", "of loads and differences: a speed that is 0.1 % of 2000 rpm off is 4 steps of a counter off by then"
)
FALSE_ALARM_RATE = Constant(1.0 / (1000.0 * 3600.0), "1/s", "one false alarm in 1000 h, as stated")
JUMPS_MOST = Constant(2.5, "1", "jumps within the memory: a disturbance is one, an overflow too, a reset two")
FRICTION_TORQUE_SHARE = Constant(
    0.05, "1", "share of the torque at relief pressure that friction or an offset may be: below it no pressure shows"
)
TURNED_LEAST = Constant(1.0, "rad", "turned within the memory; less turns power into a torque by dividing by noise")
ALARM_EVIDENCE = -math.log(FALSE_ALARM_RATE * SAMPLE)
"""Of log-likelihood ratios: a sum reaches it by chance in a sample with the probability of a false alarm (Wald)."""
INERTIA_MODEL_STD = Constant(
    0.25, "1", "oil and moved mass add a third of the shaft's torque at most, on recorded logs"
)

# Load observer.
RELEASED_TRAVEL_LEAST = Constant(2e-3, "1", "share of the stroke, the travel of a sample at usual speed")
FRICTION_SPREAD = Constant(
    1.25, "1", "friction of a usual pump over the described one, one standard deviation of makers' spread"
)
FIRST_LOAD_SHARE = 1.0 / math.sqrt(12.0)
"""Of a load that is uniform between none and the relief load, over that: its standard deviation."""
LOAD_KNOWN_SHARE = 0.1 * FIRST_LOAD_SHARE
"""The same of a load that was observed: a tenth of one that was not."""
SETTLED_SHARE = Constant(0.01, "1", "of the torque's noise: adds 0.005 % to it")
NO_PRESSURE = Constant(1e5, "Pa", "over the tank's: a chamber that a check valve fills has up to a bar")

# Leakage.
LEAKAGE_REFERENCE = Constant(
    0.3, "1", "share of the torque at relief pressure at which the exponent has no effect: mid range"
)

# Contacts.
CONTACT_EVIDENCE = Constant(
    30.0, "1", "standard deviations of the position delivered in vain: no noise does it (1e-197)"
)
CONTACT_SLIP = Constant(0.15, "1", "share of what was delivered: the softest chamber of usual machines gives 15 % more")
CONTACT_SLIP_UNKNOWN = Constant(0.5, "1", "the same at an unknown position: a full chamber gives twice a half full one")
LOAD_FALLEN_SHARE = Constant(
    0.3, "1", "share of a load that is left where it has settled on something: friction of the pumps; noise leaves half"
)
SETTLING_STD_SHARE = Constant(0.1, "1", "of the apparent way since the load settled: how well leakage is known")
SEPARATE_CONTACTS = Constant(0.05, "1", "share of the stroke between two contacts that are independent evidence")
NEAR_END_SHARE = Constant(
    0.02, "1", "share of the stroke: nearer to an end, a piston may stand on it; further, it came from elsewhere"
)
VOLUME_MODEL_STD = Constant(0.05, "1", "error of a closed volume's equation over the change of its torque")

NO_END_HOLDS = Constant(
    0.02, "1", "share of the presses without an end that reach the relief valve's setting: digging (3700 presses)"
)
END_HELD_TIME = Constant(
    0.1, "s", "in which those pass, exponential: of 3700 none held the setting for 0.6 s, an end does for seconds"
)
FALSE_CONTACT = Constant(
    1e-4, "1", "odds of no end at which a press has decided: 400 presses an hour make less than one false in a day"
)

# Hypotheses.
WAY_LEAST = Constant(
    0.01, "1", "share of the stroke: the least way that tells something, of where a piston was or that it was free"
)
BAND_STEP = Constant(
    0.3, "1", "of the logarithm of the band's width, step of adaptive conformal inference: three misses double it"
)
OUTSIDE = Constant(
    0.05, "1", "chance that what is said with 95 % is wrong: of bands, releases, stones, valves and ends"
)
_OF_LATEST = 2.0 / 9.0 / (2.0 / LATEST - 1.0)
LATEST_SURE = (1.0 - _OF_LATEST + NormalDist().inv_cdf(OUTSIDE) * math.sqrt(_OF_LATEST)) ** -1.5
"""A deviation over the root mean square of so many, surely: the 5 % quantile of chi-squared (Wilson, Hilferty)."""
OTHERWISE = Constant(
    0.01, "1", "probability that another hypothesis is true and the position outside a 95 % band: one log of a hundred"
)
RISK = Constant(1e-5, "1", "share of samples at which an error may exceed the bound, as stated")
LOG_WEIGHT_LEAST = math.log(RISK)
"""Logarithm of the least weight: a hypothesis that is as unlikely as the risk can come back within two contacts."""
CERTAIN = math.sqrt(-2.0 * math.log(RISK))
"""Standard deviations k: an error exceeds k sigma with probability exp(-k^2/2) at most (Chernoff), the risk."""
LEAK_FACTOR_LEAST = Constant(0.3, "1", "a tight pump over a catalogue's")
LEAK_FACTOR_MOST = Constant(4.0, "1", "a pump that leaks more does not lift its load")
DISPLACEMENT_TOLERANCE = Constant(0.03, "1", "of a displacement, ISO 8426")
COMPLIANCE_FACTOR_MOST = Constant(
    2.5, "1", "oil with 1 % of air, or soft hoses; the stiffest has its inverse, oil without air in rigid lines"
)
LAG_MOST = Constant(
    600.0, "s", "a thermometer that is slower, or a step that lasts longer, is that of another tank of oil"
)
LEAKAGE_EXPONENT_MOST = Constant(1.0, "1", "twice what turns laminar flow into an orifice's")

# What teaches the filters.
BLIND_SHARE = Constant(
    0.02,
    "1",
    "share of a load or of leakage: less is none, a closed valve carries the load and its pressure has settled",
)
TORQUE_ERROR_TIME = Constant(
    0.2, "s", "for which errors of a torque, friction among them, stay what they are: filters of drives"
)
TORQUE_MODEL_STD = Constant(0.1, "1", "share of a torque by which a closed volume's equation may err")
UNSEEN_FLOW_SHARE = Constant(
    0.1, "1", "share of a pump's flow that may move a piston which seems to stand at relief pressure"
)

# Stops and starts of the motor against a closed valve.
EVENT_STANDING_STD = Constant(0.03, "1", "model error of a stop over leakage and compliance, from recorded logs")
EVENT_MOVING_STD = Constant(0.05, "1", "the same of a start, whose compliance scatters by 3 to 5 %")
EVENT_GAIN_STANDING = Constant(
    0.2, "1", "share of the torque that friction at standstill may hide: 1/0.8 of a usual efficiency"
)
TORQUE_OFFSET = Constant(
    0.01, "1", "offset of a reported torque over that at relief pressure: one step of drives of 1 %"
)
EVENT_MODEL_STD = Constant(0.02, "1", "of a torque, new with each sample: kinks of the speed between two samples")
EVENT_SAMPLING = Constant(
    20.0, "1/s2", "error that all events share, by the square of the sample: 1/12 T^2 for a decay of T = 65 ms"
)
CONTACTS_ALIKE = Constant(
    0.1, "1", "share of a contact's error that is that of all contacts with the same end: together they count as ten"
)
EVENT_COUNTS = Constant(
    0.3,
    "1",
    "power of an event's likelihood: events of one machine err alike, and by up to twice as much (recorded logs)",
)

# Relief valves.
RELIEF_RANGE = Constant(
    10.0 / 3.0,
    "1",
    "standard deviations below a setting: 90 % of it at 3 %; direct acting valves close 10 to 15 % below",
)

# Angles and readings of the position.
INDEPENDENT = Constant(2.0, "1", "correlation times between independent errors: they are alike by exp(-2), 14 %")

# Status.
UNCERTAIN_SHARE = Constant(0.1, "1", "share of the stroke: standard deviation at which a position is no use")
FASTEST_SHARE = Constant(
    1.1, "1", "of the velocity at the highest speed; a correction moves the shown position no faster"
)

# State files.
CREEP_VELOCITY = Constant(1e-4, "m/s", "slower, a rod moves by less than 1 mm in 10 s: it rests")
REST_TIME = Constant(
    1.0, "s", "of rest, after which a position is worth saving; after twice that a rod has stopped, pumps are empty"
)
SAVE_CHANGE = Constant(0.2e-3, "m", "resolution of usual position sensors: smaller changes are not saved")

# Start.
START_STD = Constant(1e-3, "m", "of a position that is read from a scale")

# A second sensor at the cylinder.
OTHER_FASTEST = Constant(1.2, "1", "times the highest velocity, which no piston exceeds")

# The paper's table.
TABLE_SLOW_SHARE = Constant(
    0.05, "1", "share of the calibrated speed; slower turns move the piston too little to matter"
)
