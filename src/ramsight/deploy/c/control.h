/* ${title}: where the piston is to go, with the sensor's estimate as the only feedback.
 *
 * Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again.
 * In doubles in either precision of the sensor. C99, libm alone: no memory is taken, nothing is global.
 * The drive is declared so: ${drive}. One that does otherwise is stopped.
 *
 *   static ${p}_control control;
 *   ${p}_control_inputs order;
 *   ${p}_control_init(&control);               // at power-up: it rests, and nothing moves until it is asked to
 *   for (;;) {                                 // every ${ms} ms
 *     ${p}_control_refer(&control, &sensor);
 *     ${p}_step(&sensor, &in, &out);
 *     ${p}_control_sense(&order, &sensor, &in, &out);
 *     order.ask = ...; order.target = ...;
 *     double speed = ${p}_control_step(&control, &order);   // rad/s, reached evenly until the next sample
 *   }
 */
#ifndef ${P}_CONTROL_H
#define ${P}_CONTROL_H

#include "${p}.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Time between two steps [s]. */
#define ${P}_CONTROL_PERIOD ${period}

/* What may be asked for. After a stop it goes on when something else is asked for, or another target. A visit goes to an
 * end stop, presses on it, and rests there; who asks for one says that nothing is in the way. */
typedef enum {
  ${P}_ASK_STOP = 0,     /* bring the motor to rest in ${stopping} s; a load that the pump holds sinks from then on */
  ${P}_ASK_POSITION = 1, /* go to the target and stay there; NaN: to none */
  ${P}_ASK_STEER = 2,    /* go at the velocity `steering`; 0 holds the rod where it is */
  ${P}_ASK_HOME_LOWERED = 3, /* visit the end stop of lowering */
  ${P}_ASK_HOME_LIFTED = 4,  /* visit the end stop of lifting */
  ${P}_ASK_LEAK_TEST = 5     /* turn slowly against the closed valve, for the sensor; without a valve: nothing */
} ${p}_ask;

typedef enum {
${activities}
} ${p}_activity;

typedef enum {
${reasons}
} ${p}_reason;

/* What the control is given at a sample. */
typedef struct {
  double position, position_std;           /* of the sensor [m] */
  double velocity, load, status;           /* of the sensor [m/s, N] */
  double oil_temperature;                  /* [K] */
  double leak, displacement;               /* factors that the sensor has learned */
  double reported;                         /* 1: a report of the drive has arrived; 0: none, and all of the above counts not */
  double reported_speed, reported_torque;  /* in it [rad/s, N m] */
  double ask;                              /* ${p}_ask */
  double target;                           /* [m] */
  double steering;                         /* velocity by hand [m/s], positive extends */
  double speed;                            /* largest velocity of a move or a visit [m/s], at most ${speed}; 0: as slow as either can be */
} ${p}_control_inputs;

/* All that the control knows. */
typedef struct {
  double x[${states}];
  ${p}_activity activity; /* what it is doing */
  ${p}_reason reason;     /* why it stops or has stopped */
  double reference;       /* end stop [m] that a visit has just pressed on, for `refer`; else NaN */
} ${p}_control;

/* Make a control of a struct: at rest, with no target. */
void ${p}_control_init(${p}_control *control);

/* Before the sensor's next step: tell it of an end stop that a visit has pressed on. */
void ${p}_control_refer(const ${p}_control *control, ${p} *sensor);

/* Take over a report, and what the sensor said after it; what is asked for stays. Where no report has arrived leave out the
 * sensor's step and this, and set `reported` to 0. */
void ${p}_control_sense(${p}_control_inputs *order, const ${p} *sensor, const ${p}_inputs *in, const ${p}_outputs *out);

/* The motor's speed at the next sample [rad/s]. */
double ${p}_control_step(${p}_control *control, const ${p}_control_inputs *order);

/* English words for a reason. */
const char *${p}_reason_text(${p}_reason reason);

#ifdef __cplusplus
}
#endif

#endif
