  if (chosen == REFUSED) s->made = 0;
  unsigned char *to = (unsigned char *)s;
  for (int k = 0; k < WIDES; k++, to += sizeof(wide)) {
    const wide x = machine->start[k];
    memcpy(to, &x, sizeof x);
  }
  for (int k = WIDES; k < STATES; k++, to += sizeof(real)) {
    const real x = R(machine->start[k]);
    memcpy(to, &x, sizeof x);
  }
