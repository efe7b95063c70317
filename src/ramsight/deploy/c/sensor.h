/* ${title}: where the piston is, from the drive's speed and torque and the oil's temperature.
 *
 * Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again.
 * C99, libm alone: no memory is taken, nothing is global, nothing is called back. One struct is one sensor; several
 * may run side by side, each in one thread at a time.
 *
 *   static ${p} sensor;
 *   ${p}_inputs in;
 *   ${p}_outputs out;
 *   unsigned char bytes[${P}_BYTES];
 *   ${p}_resume(&sensor, 7, slot_0, slot_1); // at power-up: as it was before, if the position of cylinder 7 can be trusted
 *   if (somebody knows better)              // 100 mm, give or take 1 mm
 *     if (!${p}_start(&sensor, 0.1, 0.001)) ...;
 *   for (;;) {                              // every 1 ... 100 ms
 *     in.time = ...; in.motor_speed = ...; in.motor_torque = ...; in.oil_temperature = ...;
 *     if (a switch at 350 mm closes) ${p}_reference(&sensor, 0.35);
 *     ${p}_step(&sensor, &in, &out);
 *     int slot = ${p}_keep(&sensor, wanted_speed != 0, bytes);
 *     if (slot >= 0) write_slot(slot, bytes); // returns once it is in the memory; before the motor is commanded to turn
 *     motor(wanted_speed);
 *   }
 *
 * Position 0 is fully retracted; extension is positive, for position, velocity and motor speed. Torque is positive when
 * the motor drives in the direction of positive speed. All values are in SI units.
 */
#ifndef ${P}_H
#define ${P}_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* 1: reals are floats. The position and the clock stay doubles, or slow motion and small steps of time would be lost
 * in rounding; they are added, subtracted and compared alone. */
#ifndef ${P}_FLOAT
#define ${P}_FLOAT ${float}
#endif

#if ${P}_FLOAT
typedef float ${p}_real;
#else
typedef double ${p}_real;
#endif

/* Stroke of the unit [m]. */
#define ${P}_STROKE ${stroke}

/* What a position is worth; the larger, the worse. */
typedef enum {
${statuses}
} ${p}_status;

/* A sample of what the drive reports. NaN is a value that is missing. */
typedef struct {
  double time;                /* [s] of any clock; only differences count, so it is a double in either precision */
  ${p}_real motor_speed;      /* [rad/s], positive extends */
  ${p}_real motor_torque;     /* [N m] */
  ${p}_real oil_temperature;  /* [K] */
${further}} ${p}_inputs;

/* What the sensor says after a sample. */
typedef struct {
${outputs}
} ${p}_outputs;

/* What the slots in lasting memory say. */
typedef struct {
  double position;     /* of the newest, if it says that the piston rests [m] */
  double position_std; /* [m] */
  uint32_t saves;      /* number of the newest */
  int whole;           /* how many of the two are known to be whole */
  int rests;           /* whether the newest says that the piston rests at its position */
  uint32_t instance;   /* whose they are */
} ${p}_slots;

${machines}/* All that the sensor knows. To be read by nobody but a debugger; doubles stand first. */
typedef struct {
${states}
  ${p}_real reference; /* taken by the next step [m]; NaN: none */
  double seen;         /* time of the last good sample [s]; NaN: none */
  double rested;       /* for how long the piston has been at rest at a position that is known [s] */
  double position_said, position_std_said; /* after the last step [m] */
  uint32_t missed;     /* samples that could not be, one after the other */
  uint32_t made;       /* by init */
  ${p}_slots slots;
${chosen}} ${p};
${of}
/* Make a sensor of a struct, before all else. Nobody knows where the piston is: it is not referenced until an end stop or
 * a reference. A struct that init, start or resume never saw has the status "invalid" at every step. */
void ${p}_init(${p} *sensor);

/* Begin again at a known position, 0 ... stroke [m], with a standard deviation, 0 ... stroke [m]. Returns 1; or 0 if one
 * of them cannot be (outside the stroke, infinite, NaN): then the sensor is not referenced. What is known of the slots
 * stays. */
int ${p}_start(${p} *sensor, ${p}_real position, ${p}_real std);

/* The piston is at this position [m] at the next sample: a switch, a hand. NaN or infinity takes it back. */
void ${p}_reference(${p} *sensor, ${p}_real position);

/* Take one sample. Samples come 1 ... 100 ms apart; what cannot be is passed over, and the status says so. */
void ${p}_step(${p} *sensor, const ${p}_inputs *in, ${p}_outputs *out);

/* English words for a status, for example "uncertain: reference due"; never a null pointer. */
const char *${p}_text(${p}_status status);

/* Power loss. Keep two slots of so many bytes in memory that lasts. */
#define ${P}_BYTES ${bytes}

/* Call it after each step, while no slot is being written. Returns the slot (0 or 1) that these bytes have to be written
 * into now, or -1 if there is nothing to write. A slot is to be written when the piston begins to move, when it has been
 * at rest for a second, and when its position at rest has changed. `starts` is 1 if the motor is about to turn: write
 * the slot first, then let it turn. Then, whenever the power goes, the slots say where the piston is, or that nobody
 * knows; nothing has to be saved when the supply fails. */
int ${p}_keep(${p} *sensor, int starts, unsigned char bytes[${P}_BYTES]);

typedef enum {
  ${P}_NOTHING = 0, /* no whole slot of this sensor, machine and instance: as init */
  ${P}_RESUMED = 1, /* the position, and what was learned of the machine */
  ${P}_OLDER = 2,   /* a slot is damaged, erased or missing: what was learned of the machine, but no position */
  ${P}_MOVED = 3    /* the power went while the piston moved or its position was not known: the same */
} ${p}_resumed;

/* Begin with what the slots say (calls init first); either may be a null pointer, which counts as erased. Where slots
 * are kept call it at every power-up, so that the number of saves goes on. `instance` is a number of this cylinder alone,
 * among all whose slots could ever be mixed up with its own: a left and a right cylinder of the same numbers, two
 * machines of a kind. Slots of another instance count as erased. Only ${P}_RESUMED gives a position. */
${p}_resumed ${p}_resume(${p} *sensor, uint32_t instance, const unsigned char *slot_0,
                                const unsigned char *slot_1);

#ifdef __cplusplus
}
#endif

#endif
