  m->whole[1] = (int)${p}_step(&m->memory.compare, time, (double)out.position, (double)out.${bound}, (int)out.status,
                               m->real[OTHER_POSITION]);
