
/* Let a struct be the sensor of this machine, before init, start or resume; the table has to last. Returns 1; or 0 if it
 * is of another kind of machine: then every step says that the state is invalid. */
int ${p}_of(${p} *sensor, const ${p}_machine *machine);
