#define CHOSEN UINT32_C(0x4D414348)
#define REFUSED UINT32_C(0x464F5245)

/* Of whom a struct is the sensor: of the machine that was exported, if nobody has said. */
static const ${p}_machine *machine_of(const ${p} *s) { return s->chosen == CHOSEN ? s->machine : &${p}_described; }

static void set_machine(${p} *s, const ${p}_machine *machine) {
  s->machine = machine;
  s->chosen = CHOSEN;
}

int ${p}_of(${p} *s, const ${p}_machine *machine) {
  s->made = 0;
  s->chosen = REFUSED;
  if (machine == NULL || machine->kind != ${P}_KIND) return 0;
  set_machine(s, machine);
  return 1;
}

