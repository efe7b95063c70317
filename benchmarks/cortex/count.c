/* Runs the golden samples and counts instructions. QEMU's -icount shift=0 makes an instruction last a nanosecond; SysTick
 * counts a processor's clock of 25 MHz, so that a tick is 40 instructions. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include HEADER
#include GOLDEN_HEADER

#define SYST ((volatile uint32_t *)0xE000E010u) /* control, reload, current */
#define TICK 40u
#define PAINTED 8192
#define PAINT 0xA5u

static SENSOR sensor;

/* Stack that a step takes, libm within it: what is below here is painted, and looked at afterwards. */
static unsigned deepest(const INPUTS *in, OUTPUTS *out) {
  unsigned char *low = (unsigned char *)__builtin_frame_address(0) - PAINTED - 64;
  for (volatile unsigned char *at = low; at < low + PAINTED; at++) *at = PAINT;
  STEP(&sensor, in, out);
  unsigned clean = 0;
  while (clean < PAINTED && ((volatile unsigned char *)low)[clean] == PAINT) clean++;
  return PAINTED + 64 - clean;
}

int main(void) {
  INPUTS in;
  OUTPUTS out;
  uint64_t ticks = 0;
  uint32_t most = 0;
  unsigned stack = 0;
  memset(&in, 0, sizeof in);
  START(&sensor, (REAL)golden_start, (REAL)golden_std);
  SYST[1] = 0xFFFFFFu;
  SYST[2] = 0;
  SYST[0] = 5u; /* on, by the processor's clock */
  for (int k = 0; k < GOLDEN; k++) {
    in.time = golden_in[k][0];
    in.motor_speed = (REAL)golden_in[k][1];
    in.motor_torque = (REAL)golden_in[k][2];
    in.oil_temperature = (REAL)golden_in[k][3];
    REFERENCE(&sensor, (REAL)golden_in[k][4]);
    if (k % 20 == 19) {
      const unsigned took = deepest(&in, &out);
      if (took > stack) stack = took;
      continue;
    }
    const uint32_t before = SYST[2];
    STEP(&sensor, &in, &out);
    const uint32_t spent = (before - SYST[2]) & 0xFFFFFFu;
    ticks += spent;
    if (spent > most) most = spent;
  }
  printf("mean %lu most %lu stack %u state %u saved %u last %.6f\n", (unsigned long)(TICK * ticks / (GOLDEN - GOLDEN / 20)),
         (unsigned long)(TICK * most), stack, (unsigned)sizeof sensor, (unsigned)SAVED, (double)out.position);
  return 0;
}
