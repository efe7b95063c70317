/* ${title}. Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again. */
/* ${part} */
#include "${p}_step.h"

${functions}