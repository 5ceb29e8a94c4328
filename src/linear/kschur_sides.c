/* One supernode of a real L with four right-hand sides or eight. */
#include "../base/kschur_wide.h"

#define ENTRY double
#define VECTOR four
#define SIDES 4
#define TIMES(l, x) ((l)*(x))
#define ADDED(y, l, x) ((y) + (l)*(x))
#define FORWARD kschur_forward_sides
#define BACKWARD kschur_backward_sides
#include "kschur_sides.h"
