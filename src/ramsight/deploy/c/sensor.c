/* ${title}. Made by ramsight ${version} from the machine "${machine}"; do not edit, export anew. */
#include "${p}.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#if defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__
#error "NaN is a value that is missing: compile without -ffast-math and -ffinite-math-only"
#endif

typedef ${p}_real real;
typedef double wide;
#define R(x) ((real)(x))
#if ${P}_FLOAT
#define SQRT sqrtf
#define EXP expf
#define LOG logf
#define TANH tanhf
#define POW powf
#define ABS fabsf
#else
#define SQRT sqrt
#define EXP exp
#define LOG log
#define TANH tanh
#define POW pow
#define ABS fabs
#endif

/* The machine. */
${constants}

void ${p}_init(${p} *s) {
  memset(s, 0, sizeof *s);
  s->reference = (real)NAN;
${initial}
}

void ${p}_start(${p} *s, real position, real std) {
  const uint32_t saves = s->saves;
  ${p}_init(s);
  s->saves = saves;
  if (position == position && std == std) {
    s->position = (wide)position;
    s->is_referenced = R(1.0);
    s->covariance_00 = std * std;
  }
}

void ${p}_reference(${p} *s, real position) { s->reference = position; }

void ${p}_step(${p} *s, const ${p}_inputs *in, ${p}_outputs *out) {
  /* The step knows differences of time alone: now is 0, and what was before is below it. */
  const int clocked = in->time > -1e12 && in->time < 1e12;
  const wide u_time = clocked ? 0.0 : (wide)NAN;
${relative}
  const real u_motor_speed = in->motor_speed;
  const real u_motor_torque = in->motor_torque;
  const real u_oil_temperature = in->oil_temperature;
  const int f_reference = s->reference == s->reference;
  const real u_reference = f_reference ? s->reference : R(0.0);
  const real u_reference_known = (real)f_reference;
${step}
  s->reference = (real)NAN;
}

const char *${p}_text(${p}_status status) {
  switch (status) {
${texts}
  }
  return "unknown status";
}

/* A slot: identity of sensor, machine and precision, number of the save, the states, checksum; little-endian. */
#define IDENTITY (UINT32_C(${identity}) ^ ${P}_FLOAT)
#define SUM_AT (${P}_BYTES - 4)

static uint32_t checksum(const unsigned char *bytes, size_t count) {
  uint32_t crc = UINT32_C(0xFFFFFFFF);
  while (count--) {
    crc ^= *bytes++;
    for (int bit = 0; bit < 8; bit++) crc = (crc >> 1) ^ (crc & 1u ? UINT32_C(0xEDB88320) : 0u);
  }
  return ~crc;
}

static unsigned char *put(unsigned char *at, uint64_t value, int bytes) {
  while (bytes--) {
    *at++ = (unsigned char)(value & 0xFFu);
    value >>= 8;
  }
  return at;
}

static uint64_t get(const unsigned char *at, int bytes) {
  uint64_t value = 0;
  while (bytes--) value = (value << 8) | at[bytes];
  return value;
}

/* Every state of the struct, doubles first, as bits. */
#define WIDES ${wides}
#define STATES ${count}

int ${p}_save(${p} *s, unsigned char bytes[${P}_BYTES]) {
  const unsigned char *from = (const unsigned char *)s;
  unsigned char *at = put(put(bytes, IDENTITY, 4), ++s->saves, 4);
  for (int k = 0; k < WIDES; k++, from += sizeof(wide)) {
    uint64_t bits;
    memcpy(&bits, from, sizeof bits);
    at = put(at, bits, 8);
  }
  for (int k = WIDES; k < STATES; k++, from += sizeof(real)) {
#if ${P}_FLOAT
    uint32_t bits;
#else
    uint64_t bits;
#endif
    memcpy(&bits, from, sizeof bits);
    at = put(at, bits, (int)sizeof bits);
  }
  put(at, checksum(bytes, SUM_AT), 4);
  return (int)(s->saves & 1u);
}

static int whole(const unsigned char *slot) {
  return slot != NULL && get(slot, 4) == IDENTITY && get(slot + SUM_AT, 4) == checksum(slot, SUM_AT);
}

static int empty(const unsigned char *slot) {
  if (slot == NULL) return 1;
  for (size_t k = 1; k < ${P}_BYTES; k++)
    if (slot[k] != slot[0]) return 0;
  return slot[0] == 0x00 || slot[0] == 0xFF;
}

${p}_resumed ${p}_resume(${p} *s, const unsigned char *slot_0, const unsigned char *slot_1) {
  const unsigned char *slot = whole(slot_0) ? slot_0 : NULL, *other = slot_1;
  ${p}_init(s);
  if (whole(slot_1) && (slot == NULL || (int32_t)((uint32_t)get(slot_1 + 4, 4) - (uint32_t)get(slot + 4, 4)) > 0)) {
    slot = slot_1;
    other = slot_0;
  }
  if (slot == NULL) return ${P}_NOTHING;
  const unsigned char *from = slot + 8;
  unsigned char *to = (unsigned char *)s;
  for (int k = 0; k < WIDES; k++, from += 8, to += sizeof(wide)) {
    const uint64_t bits = get(from, 8);
    memcpy(to, &bits, sizeof bits);
  }
  for (int k = WIDES; k < STATES; k++, from += sizeof(real), to += sizeof(real)) {
#if ${P}_FLOAT
    const uint32_t bits = (uint32_t)get(from, 4);
#else
    const uint64_t bits = get(from, 8);
#endif
    memcpy(to, &bits, sizeof bits);
  }
  s->saves = (uint32_t)get(slot + 4, 4);
  /* Time begins anew, and a piston that moved may have gone on for a while. */
  const real std = SQRT(s->covariance_00) + ABS(s->velocity) * R(${settling});
  s->started = R(0.0);
  s->clocked = R(0.0);
  s->covariance_00 = std * std;
  if (!whole(other) && !empty(other)) {
    ${p} fresh;
    ${p}_init(&fresh);
${forgotten}
    return ${P}_OLDER;
  }
  return ${P}_RESUMED;
}
