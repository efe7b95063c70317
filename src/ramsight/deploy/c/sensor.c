/* ${title}. Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again. */
#include "${p}_step.h"

#include <stddef.h>
#include <string.h>

${defined}#define STROKE R(${stroked}) /* [m] */
#define SLACK R(${slack})  /* by which a start may lie outside it [m] */
#define MADE UINT32_C(0x52414D53)
/* States stand first in the struct, doubles before reals. */
#define WIDES ${wides}
#define STATES ${count}

static int is_number(real x) { return ABS(x) <= R(1e30); }

${begins}void ${p}_init(${p} *s) {
${keeps}  memset(s, 0, sizeof *s);
${kept}  s->reference = (real)NAN;
  s->seen = s->position_said = s->position_std_said = (double)NAN;
  s->made = MADE;
${initial}
}

int ${p}_start(${p} *s, real position, real std) {
  ${p}_slots slots;
  memset(&slots, 0, sizeof slots);
  if (s->made == MADE) slots = s->slots;
  ${p}_init(s);
  s->slots = slots;
  if (!(position >= -SLACK && position <= STROKE + SLACK && std >= R(0.0) && std <= STROKE)) return 0;
  s->position = (wide)(position < R(0.0) ? R(0.0) : position > STROKE ? STROKE : position);
  s->${known} = s->${since} = R(1.0);
  s->${variance} = std * std;
  return 1;
}

void ${p}_reference(${p} *s, real position) { s->reference = is_number(position) ? position : (real)NAN; }

#define TURNING R(${turning})   /* slower, the motor moves nothing [rad/s] */
#define CREEPING R(${creeping}) /* slower, the piston rests [m/s] */
#define RESTING ${resting}      /* at rest for so long, its position is worth a slot [s] */
#define GAP 0.5           /* a longer gap may hide a motion [s] */
#define MISSED 5u         /* more samples in a row that cannot be may, too */

/* For the slots: for how long the piston has been at rest at a position that is known. */
static void watch(${p} *s, const ${p}_inputs *in, const ${p}_outputs *out) {
  /* A drive that says nothing changes nothing: it often loses its power before this unit does. */
  if (out->status == ${P}_INPUT_LOST || out->status == ${P}_TIME_FROZEN) return;
  if (out->status >= ${P}_TOO_UNCERTAIN) {
    if (s->missed < MISSED) s->missed++;
    else s->rested = 0.0;
    return;
  }
  const double passed = s->seen == s->seen ? in->time - s->seen : 0.0;
  const int still = ABS(in->motor_speed) < TURNING && ABS(out->velocity) < CREEPING;
  const int known = out->status < ${P}_NOT_REFERENCED && passed >= 0.0 && passed <= GAP;
  s->rested = still && known ? s->rested + passed : 0.0;
  s->missed = 0;
  s->seen = in->time;
  s->position_said = (double)out->position;
  s->position_std_said = (double)out->position_std;
}

void ${p}_step(${p} *s, const ${p}_inputs *in, ${p}_outputs *out) {
  if (s->made != MADE) {
${unknown}
    out->status = ${P}_STATE_INVALID;
    return;
  }
  ${p}_work w;
  const int clocked = in->time > -1e12 && in->time < 1e12;
  const int referenced = s->reference == s->reference;
  /* The step knows differences of time alone: now is 0, and what was before is below it. */
${begun}
${calls}
  s->reference = (real)NAN;
  watch(s, in, out);
}

const char *${p}_text(${p}_status status) {
  switch (status) {
${texts}
  }
  return "unknown status";
}

/* A slot: identity of sensor, machine and precision; number of the save; whether the piston rests at its position; the
 * instance; the states; checksum. Little-endian. */
#define IDENTITY (${identity} ^ ${P}_FLOAT)
#define RESTS UINT32_C(0x54534552)
#define MOVES UINT32_C(0x45564F4D)
#define STATES_AT 16
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

static void pack(const ${p} *s, uint32_t phase, unsigned char *bytes) {
  const unsigned char *from = (const unsigned char *)s;
  unsigned char *at = put(put(put(put(bytes, IDENTITY, 4), s->slots.saves, 4), phase, 4), s->slots.instance, 4);
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
}

/* Whether a state can be: numbers all of them, no variance below 0, a position not far from the stroke. */
static int possible(const ${p} *s) {
  const unsigned char *from = (const unsigned char *)s;
  for (int k = 0; k < WIDES; k++, from += sizeof(wide)) {
    wide x;
    memcpy(&x, from, sizeof x);
    if (!(fabs(x) <= 1e30)) return 0;
  }
  for (int k = WIDES; k < STATES; k++, from += sizeof(real)) {
    real x;
    memcpy(&x, from, sizeof x);
    if (!is_number(x)) return 0;
  }
  const int known = s->${known} == R(0.0) || s->${known} == R(1.0);
  const int since = s->${since} == R(0.0) || s->${since} == R(1.0);
  const double stroke = (double)STROKE;
${variances}
  return known && since && s->position >= -stroke && s->position <= 2.0 * stroke;
}

/* Take a slot, if it is whole and of this sensor, machine and instance. */
static int unpack(${p} *s, uint32_t instance, const unsigned char *slot) {
  ${p}_init(s);
  s->slots.instance = instance;
  if (slot == NULL || get(slot, 4) != IDENTITY || get(slot + SUM_AT, 4) != checksum(slot, SUM_AT)) return 0;
  if (get(slot + 12, 4) != instance) return 0;
  const uint32_t phase = (uint32_t)get(slot + 8, 4);
  const unsigned char *from = slot + STATES_AT;
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
  s->slots.saves = (uint32_t)get(slot + 4, 4);
  s->slots.rests = phase == RESTS;
  return (phase == RESTS || phase == MOVES) && possible(s);
}

/* What was learned of the machine, without a position. */
static void learned(const ${p} *from, ${p} *to) {
${likewise}  ${p}_init(to);
${learned}
  to->slots = from->slots;
}

int ${p}_keep(${p} *s, int starts, unsigned char bytes[${P}_BYTES]) {
  if (s->made != MADE) return -1;
  ${p}_slots *slots = &s->slots;
  const int rests = !starts && s->rested >= RESTING;
  const int changed = fabs(s->position_said - slots->position) > ${moved} ||
                      s->position_std_said > slots->position_std + ${std_change};
  if (slots->whole == 2 && rests == slots->rests && !(rests && changed)) return -1;
  slots->saves++;
  slots->whole += slots->whole < 2;
  slots->rests = rests;
  if (rests) {
    slots->position = s->position_said;
    slots->position_std = s->position_std_said;
    pack(s, RESTS, bytes);
  } else {
    ${p} moves;
    learned(s, &moves);
    pack(&moves, MOVES, bytes);
  }
  return (int)(slots->saves & 1u);
}

${p}_resumed ${p}_resume(${p} *s, uint32_t instance, const unsigned char *slot_0, const unsigned char *slot_1) {
  ${p} other;
${beside}  const int whole_0 = unpack(&other, instance, slot_0);
  const uint32_t saves_0 = other.slots.saves;
  const int whole_1 = unpack(s, instance, slot_1);
  const uint32_t ahead = s->slots.saves - saves_0; /* of slot 1 */
  if (!whole_0 && !whole_1) {
    ${p}_init(s);
    s->slots.instance = instance;
    return ${P}_NOTHING;
  }
  if (whole_0 && (!whole_1 || (int32_t)ahead < 0)) *s = other;
  /* A position is accepted only where both slots are whole and one was saved just after the other: one that is torn or
   * erased may have said that the piston moves. */
  const int complete = whole_0 && whole_1 && (ahead == 1u || ahead == UINT32_C(0xFFFFFFFF));
  s->slots.whole = complete ? 2 : 1;
  if (!complete || !s->slots.rests) {
    learned(s, &other);
    *s = other;
    s->slots.rests = 0;
    return complete ? ${P}_MOVED : ${P}_OLDER;
  }
  /* Time begins again, and a piston that crept may have gone on for a while. */
  const real std = SQRT(s->${variance}) + ABS(s->${velocity}) * R(${settling});
  s->${started} = R(0.0);
  s->${clocked} = R(0.0);
  s->${since} = R(0.0);
  s->${variance} = std * std;
  s->rested = RESTING;
  s->slots.position = (double)s->position;
  s->slots.position_std = (double)std;
  return ${P}_RESUMED;
}
