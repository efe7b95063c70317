/* What is worked out alike for each hypothesis. */
#define EACH ${each}
typedef struct {
${of_each}
} ${p}_of_each;

