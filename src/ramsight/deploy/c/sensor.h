/* ${title}: where the piston is, from the drive's speed and torque and the oil's temperature.
 *
 * Made by ramsight ${version} from the machine "${machine}"; do not edit, export anew.
 * C99, libm alone: no memory is taken, nothing is global, nothing is called back. One struct is one sensor; several
 * may run side by side, each in one thread at a time.
 *
 *   static ${p} sensor;
 *   ${p}_inputs in;
 *   ${p}_outputs out;
 *   ${p}_resume(&sensor, slot_0, slot_1);   // at power-up: as it was before, if there is such a state
 *   ${p}_start(&sensor, 0.1, 0.001);        // if somebody knows better: 100 mm, give or take 1 mm
 *   for (;;) {                              // every 1 ... 100 ms
 *     in.time = ...; in.motor_speed = ...; in.motor_torque = ...; in.oil_temperature = ...;
 *     if (a switch at 350 mm closes) ${p}_reference(&sensor, 0.35);
 *     ${p}_step(&sensor, &in, &out);
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
} ${p}_inputs;

/* What the sensor says after a sample. */
typedef struct {
${outputs}
} ${p}_outputs;

/* All that the sensor knows. To be read by nobody but a debugger; doubles stand first. */
typedef struct {
${states}
  ${p}_real reference;  /* taken by the next step [m]; NaN: none */
  uint32_t saves;       /* how often the state was saved */
} ${p};

/* Make a sensor of a struct, before all else. Nobody knows where the piston is: it is not referenced until an end stop or
 * a reference. */
void ${p}_init(${p} *sensor);

/* Begin anew at a known position [m] with a standard deviation [m]; NaN: at one that nobody knows. The number of saves
 * goes on. */
void ${p}_start(${p} *sensor, ${p}_real position, ${p}_real std);

/* The piston is at this position [m] at the next sample: a switch, a hand. NaN takes it back. */
void ${p}_reference(${p} *sensor, ${p}_real position);

/* Take one sample. Samples come 1 ... 100 ms apart; what cannot be is passed over, and the status says so. */
void ${p}_step(${p} *sensor, const ${p}_inputs *in, ${p}_outputs *out);

/* English words for a status, for example "uncertain: reference due"; never a null pointer. */
const char *${p}_text(${p}_status status);

/* Power loss. Keep two slots of so many bytes in memory that lasts. */
#define ${P}_BYTES ${bytes}

/* Write the state as bytes, the same on every machine, with a checksum; returns the slot (0 or 1) to keep them in, so
 * that the newer slot stays whole whatever happens meanwhile. */
int ${p}_save(${p} *sensor, unsigned char bytes[${P}_BYTES]);

typedef enum {
  ${P}_NOTHING = 0, /* no slot of this sensor and machine: as init */
  ${P}_RESUMED = 1,
  ${P}_OLDER = 2    /* the newer slot is damaged: what was learned of the machine is back, the position is not */
} ${p}_resumed;

/* Begin with the newest slot that is whole (calls init first); either may be a null pointer. A slot of equal bytes (0,
 * 0xFF) is empty. Where slots are kept call it at every power-up, so that the number of saves goes on. */
${p}_resumed ${p}_resume(${p} *sensor, const unsigned char *slot_0, const unsigned char *slot_1);

#ifdef __cplusplus
}
#endif

#endif
