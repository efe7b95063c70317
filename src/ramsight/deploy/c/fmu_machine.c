  ${p}_machine *own = &m->memory.machine;
  own->kind = (uint32_t)m->real[${first}];
  own->identity = (uint32_t)m->real[${first} + 1];
  memcpy(&own->stroke, &m->real[${first} + 2], ${count} * sizeof(double)); /* all that follows is doubles */
  if (!${p}_of(s, own)) return "the parameters are those of a machine of another kind";
