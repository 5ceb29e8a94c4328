/* As kschur_sides.h for a complex L: a product has the real part of its entry times a vector, and the imaginary part times i times
   the vector. The including file defines VECTOR, SIDES, TURNED(x), which is i x, FORWARD and BACKWARD. */
typedef struct {
   double re, im;
} number;

#define ENTRY number
#define TIMES(l, x) ((l).re*(x) + (l).im*TURNED(x))
#define ADDED(y, l, x) ((y) + (l).re*(x) + (l).im*TURNED(x))
#include "kschur_sides.h"
