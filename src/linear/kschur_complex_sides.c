/* One supernode of a complex L with two right-hand sides or four. */
#include "../base/kschur_wide.h"

#define VECTOR four
#define SIDES 2
#define TURNED(x) ((four){(x)[1], (x)[0], (x)[3], (x)[2]}*(four){-1, 1, -1, 1})
#define FORWARD kschur_forward_complex_sides
#define BACKWARD kschur_backward_complex_sides
#include "kschur_complex_sides.h"
