"""Numbers that decide something in the control, each with its unit and its reason; none stands elsewhere in it.

Where the reason is a *choice*, it names the physical range and what happens on either side of it.
"""

from ramsight.constant import Constant

# Sentinels: a compiler may turn comparisons round, and NaN would not survive it.
NO_PLACE = Constant(-1e3, "m", "a position that no cylinder has, for none")
NO_ORDER = Constant(-1.0, "1", "no `Ask`: as the last one, whatever is asked for next is new")
NO_POSITION = Constant(1e31, "m", "the position before the first report: no finite number by LARGEST_NUMBER")
NO_REPORT = Constant(1e30, "1", "a reported value before the first report: no drive reports it")
LARGEST_NUMBER = Constant(1e30, "1", "a larger value, or NaN, is no number; no quantity here comes near")

# Limits of a move
SPEED_SHARE = Constant(0.5, "1", "of the rod's speed at the highest motor speed; the rest is for leakage and errors")
RAMP_TIME = Constant(0.8, "s", "to the largest speed, as the ramps of the paper's recordings")
SMOOTHING_TIME = Constant(0.2, "s", "one period of 5 Hz, the slowest swing of a full chamber: its mean has none of it")
LANDING_SPEED_SHARE = Constant(
    0.15, "1", "choice: a contact has 2 % of the kinetic energy; less takes longer in the zone"
)
LANDING_ZONE_SHARE = Constant(0.04, "1", "of the stroke: several times a sensor's error before its first reference")
ARRIVAL_STEPS = Constant(1.5, "1", "steps of the deceleration: the last one and half for rounding end a trajectory")
FOLLOWING_TIME = Constant(
    0.5, "s", "choice: 0.2 s of latency and 0.1 s of smoothing stay within; a longer one finds a blocked rod later"
)

# Motor speeds
COLDEST_OIL = Constant(
    243.15, "K", "choice: hydraulic oil works from -30 to 110 C; a report outside is the thermometer's fault"
)
HOTTEST_OIL = Constant(383.15, "K", "as COLDEST_OIL")
REACHABLE_SHARE = Constant(0.9, "1", "of the highest motor speed for the trajectory; the rest is for corrections")
FORCE_TAPER = Constant(
    0.1, "1", "of the largest force: choice; less turns a load's noise into steps, more slows moves that may go on"
)
STANDSTILL_ROUNDING = Constant(1e-9, "1", "relative steepness and rad/s: rounding must not ask for a sample more")

# How a cylinder is driven: defaults of Tuning
POSITION_GAIN = Constant(
    1.5, "1/s", "sensor steps of 0.1 mm ask for 0.15 mm/s; 0.2 s of latency bears 2.6 /s with 60 deg of phase margin"
)
CREEPING_SPEED = Constant(
    1e-3, "m/s", "least lift behind a valve: slower, the leakage, known to a sixth, could exceed what is asked for"
)
OPENING_RATIO = Constant(2.5, "1", "of lowering: a valve is open at twice its opening speed, and a quarter for errors")
SETTLE_TIME = Constant(0.4, "s", "two swings of a full chamber at 5 Hz, after which a landing is judged")
TARGET_TOLERANCE = Constant(0.5e-3, "m", "above the sensor's noise, a quarter of the 2 mm asked of a described machine")
LANDING_TRIES = Constant(
    5.0, "1", "each leaves a fraction of the error; a wandering sensor is not followed without end"
)
DEAD_BAND = Constant(0.2e-3, "m", "the sensor's noise at rest")
MOTOR_ACCELERATION = Constant(
    600.0, "rad/s2", "highest speed in 0.7 s, with a quarter of the loader motors' torque left at relief pressure"
)
UNCERTAIN_SPEED_SHARE = Constant(0.5, "1", "the way to standstill, by the square of the speed, is a quarter")
HOMING_SPEED_SHARE = Constant(0.3, "1", "by the square, the way that goes on after the contact is a tenth")
CONTACT_TIME = Constant(0.5, "s", "standstill that is a contact: a chamber at 5 Hz has swung 2.5 times")
PRESSING_TIME = Constant(3.0, "s", "until the sensor has accepted a contact; less, and it may not have")
PRESSING_SHARE = Constant(0.25, "1", "of the load at relief pressure: above friction (0.05), the valve stays shut")
LEAK_TEST_TIME = Constant(8.0, "s", "400 torques of 20 ms, whose noise of 0.5 N m leaves 0.03 N m")
LEAK_TEST_SIGMAS = Constant(2.6, "1", "the rod lifts in one leak test of 200, where a pump leaks less than described")
LEAK_TEST_LEAST = Constant(0.2, "1", "of the speed that lifts: choice; slower, the torque is friction and noise")

# Activities
CONTACT_RELEASE_WAY = Constant(
    5e-3, "m", "choice: a stop gives way by a millimetre; a longer way uses the old load off the stop"
)
BLOCKED_TIME = Constant(1.0, "s", "at the largest force: five swings at 5 Hz, so no swing counts as an obstacle")
LOAD_AVERAGING = Constant(0.5, "s", "time constant: 25 samples leave a seventh of the noise")
PRESSURE_TIME = Constant(0.2, "s", "one period of 5 Hz: a chamber comes to the load's pressure, and the rod moves")
HELD_SPEED_SHARE = Constant(0.3, "1", "of the homing speed: choice between standstill and motion, nearer to standstill")
FAR_SIGMAS = Constant(4.0, "1", "the stop is nearer than that with probability 3e-5")
SEARCH_FACTOR = Constant(
    1.5, "1", "choice: times a whole stroke at homing speed; less gives up a slow rod, more waits for nothing"
)
SEARCH_PRESSINGS = Constant(2.0, "1", "pressing times beside the way: one for the contact, one spare")
STOPPING_TIME = Constant(0.16, "s", "to the command's standstill: with the 0.14 s of the watch at most, 0.3 s")

# The watch over the drive
NOTICING_TIME = Constant(
    0.08, "s", "in which a motor that does not follow is noticed: with STOPPING_TIME less than 0.3 s"
)
STALL_TIME = Constant(1.0, "s", "at the torque limit: a pump presses a chamber to relief pressure in a tenth of it")
STANDSTILL_SPEED = Constant(1.0, "rad/s", "choice: 10 steps of 1 rpm; below, a motor at its limit stands")
MOVED_STEPS = Constant(2.0, "1", "steps of the reported speed: one may be rounding")
DEPARTURE_SAMPLES = Constant(
    3.0, "1", "commands tremble by 0.06 rad/s: three are 2 steps of 1 rpm off a mean of three with probability 1e-8"
)
STEADY_STEPS = Constant(0.5, "1", "steps of the reported speed, within which rounding alone could hide a command")
TREMBLE_SIGMAS = Constant(6.0, "1", "peak to peak: a command within +-3 standard deviations is hidden in the noise")
TORQUE_LIMIT_SIGMAS = Constant(3.0, "1", "below the largest torque, which noise may hide with probability 1e-3")
PATIENCE_SHARE = Constant(
    3.0, "1", "choice: a drive that is late by a third more than declared is slow, beyond it does not follow"
)
PATIENCE_SAMPLES = Constant(2.0, "1", "choice: and by two samples at least, as delays are rounded to samples")
ROUNDING = Constant(1e-9, "1", "of a count of samples: a delay of whole samples is whole")

# Reports that repeat
FALSE_ALARM_RATE = Constant(1.0 / 3.6e6, "1/s", "one in 1000 h of each kind: half a year of a machine's work")
PRIOR_REPEATS = Constant(3.0, "1", "counted before any sample: upper 95 % bound of a rare event (rule of three)")
SURE_RUNS = Constant(10.0, "1", "alarms' lengths that were looked at: a speed without noise would have shown one")
TAIL_SIGMAS = Constant(6.0, "1", "no value is looked for beyond: one in 500 million")
NEVER_SAMPLES = Constant(1.0e9, "1", "half a year of samples of 20 ms: a longer run is never waited for")
