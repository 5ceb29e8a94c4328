/* One supernode of a complex L with one right-hand side. */
#include "../base/kschur_wide.h"

typedef double two __attribute__((vector_size(16), aligned(8), may_alias));

#define VECTOR two
#define SIDES 1
#define TURNED(x) ((two){(x)[1], (x)[0]}*(two){-1, 1})
#define FORWARD kschur_forward_complex_side
#define BACKWARD kschur_backward_complex_side
#include "kschur_complex_sides.h"
