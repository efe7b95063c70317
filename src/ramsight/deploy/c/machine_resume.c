  if (s->chosen == REFUSED) {
    ${p}_init(s);
    return ${P}_NOTHING;
  }
  set_machine(&other, machine_of(s));
