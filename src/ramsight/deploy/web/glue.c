/* One sensor of a WebAssembly instance, with its sample and its outputs where JavaScript reads and writes them. */
#include "${p}.h"

#include <stddef.h>

#define EXPORTED(name) __attribute__((export_name(name)))

static ${p} sensor;
static ${p}_inputs in;
static ${p}_outputs out;
static unsigned char slots[2][${P}_BYTES], written[${P}_BYTES];

/* JavaScript sees both as arrays of doubles; the status takes the place of one, and `step` returns it. */
typedef char inputs_are_doubles[sizeof in == ${inputs} * sizeof(double) ? 1 : -1];
typedef char outputs_are_doubles[sizeof out == ${outputs} * sizeof(double) ? 1 : -1];

EXPORTED("inputs") void *place_of_inputs(void) { return &in; }
EXPORTED("outputs") void *place_of_outputs(void) { return &out; }
EXPORTED("slot") void *place_of_slot(int number) { return slots[number & 1]; }
EXPORTED("written") void *place_of_written(void) { return written; }
EXPORTED("bytes") int bytes_of_slot(void) { return ${P}_BYTES; }

EXPORTED("init") void init(void) { ${p}_init(&sensor); }
EXPORTED("start") int start(double position, double std) { return ${p}_start(&sensor, position, std); }
EXPORTED("reference") void reference(double position) { ${p}_reference(&sensor, position); }
EXPORTED("step") int step(void) {
  ${p}_step(&sensor, &in, &out);
  return (int)out.status;
}
EXPORTED("keep") int keep(int starts) { return ${p}_keep(&sensor, starts, written); }
EXPORTED("resume") int resume(uint32_t instance, int has_0, int has_1) {
  return (int)${p}_resume(&sensor, instance, has_0 ? slots[0] : NULL, has_1 ? slots[1] : NULL);
}
