/* The first instructions of a Cortex-M of QEMU's mps2 boards: vectors, the floating-point unit on, then newlib's start. */
#include <stdint.h>

extern void _start(void);
extern uint32_t stack_top;

void reset(void) {
  *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR: full access to the floating-point unit */
  __asm volatile("dsb\n\tisb");
  _start();
}

static void fault(void) {
  for (;;) __asm volatile("bkpt 0");
}

__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    (void (*)(void))(uintptr_t)&stack_top, reset, fault, fault, fault, fault, fault};
