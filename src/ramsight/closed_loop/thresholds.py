"""Numbers that decide something in plans and simulated loops, as in the table of the control."""

from ramsight.constant import Constant

WORTH_SHARE = Constant(
    0.1, "1", "of the standard deviation: choice; a smaller gain is within what the prediction leaves out"
)
NEARLY_SHARE = Constant(0.1, "1", "of the possible gain that is left for a shorter visit: choice as WORTH_SHARE")
HORIZON = Constant(3600.0, "s", "choice: an hour of work is looked ahead for a reference; more costs time alone")
MOST_VISITS = Constant(
    2.0, "1", "in a row: two separate leakage from displacement; sequences of three cost the square of the time"
)
LOAD_SAMPLES = Constant(1500.0, "1", "choice: half a minute of 20 ms; older loads are those of other work")
LOAD_SPEED = Constant(1e-3, "m/s", "as CREEPING_SPEED: a slower rod rests")
LONGEST_MOVE = Constant(600.0, "s", "choice: longer than any move; an order that takes longer is given up")
LOOP_SETTLE_TIME = Constant(0.5, "s", "choice: SETTLE_TIME, rounded up")
POSITION_SENSOR_STD = Constant(0.5e-3, "m", "of the position sensor that a virtual one is compared with")
