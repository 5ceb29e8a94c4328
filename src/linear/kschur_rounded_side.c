/* One supernode of a real L in single precision with one right-hand side. */
#include "../base/kschur_wide.h"

#define ENTRY float
#define VECTOR double
#define SIDES 1
#define TIMES(l, x) ((double)(l)*(x))
#define ADDED(y, l, x) ((y) + (double)(l)*(x))
#define FORWARD kschur_forward_rounded_side
#define BACKWARD kschur_backward_rounded_side
#include "kschur_sides.h"
