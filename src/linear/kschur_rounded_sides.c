/* One supernode of a real L in single precision with four right-hand sides or eight. */
#include "../base/kschur_wide.h"

#define ENTRY float
#define VECTOR four
#define SIDES 4
#define TIMES(l, x) ((double)(l)*(x))
#define ADDED(y, l, x) ((y) + (double)(l)*(x))
#define FORWARD kschur_forward_rounded_sides
#define BACKWARD kschur_backward_rounded_sides
#include "kschur_sides.h"
