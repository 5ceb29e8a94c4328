/* Forward and backward substitution in one supernode of L for a block of four right-hand sides, stored row by row: each entry of L
   is read once for all four. BLAS would pack the block first, which for four columns takes as long as the products.

   lower: the strict lower triangle T, packed by columns, then the block B of the rows below it, below x columns.
   x: 4 x columns. rows: 4 x below. */
#include <stddef.h>

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));

#define INLINE static inline __attribute__((always_inline))

#if defined(__x86_64__) && defined(__GNUC__)
#define WIDE __attribute__((target("avx2,fma")))
#define HAS_WIDE (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
#else
#define WIDE
#define HAS_WIDE 0
#endif

/* rows := rows + B x for a few columns; `columns` is a constant after inlining. */
INLINE void add_products(int columns, ptrdiff_t below, const double *b, const four *restrict x, four *restrict rows)
{
   for (ptrdiff_t i = 0; i < below; i++) {
      four sum = rows[i];
      for (int j = 0; j < columns; j++) sum += b[i + j*below]*x[j];
      rows[i] = sum;
   }
}

/* x := x - B^T rows for a few columns; `columns` is a constant after inlining. */
INLINE void subtract_products(int columns, ptrdiff_t below, const double *b, const four *restrict rows, four *restrict x)
{
   four sums[8];

   for (int j = 0; j < columns; j++) sums[j] = (four){0, 0, 0, 0};
   for (ptrdiff_t i = 0; i < below; i++)
      for (int j = 0; j < columns; j++) sums[j] += b[i + j*below]*rows[i];
   for (int j = 0; j < columns; j++) x[j] -= sums[j];
}

/* x := T^{-1} x, four columns of T at a time; returns the end of T. */
INLINE const double *solve_triangle(ptrdiff_t columns, const double *lower, four *x)
{
   ptrdiff_t j = 0;

   for (; j + 4 <= columns; j += 4) {
      /* So that each is counted from row 0. */
      const double *first = lower - (j + 1), *second = first + columns - j - 2, *third = second + columns - j - 3;
      const double *fourth = third + columns - j - 4;
      four x0 = x[j], x1 = x[j + 1], x2 = x[j + 2], x3 = x[j + 3];

      x1 -= first[j + 1]*x0;
      x2 -= first[j + 2]*x0 + second[j + 2]*x1;
      x3 -= first[j + 3]*x0 + second[j + 3]*x1 + third[j + 3]*x2;
      x[j + 1] = x1;
      x[j + 2] = x2;
      x[j + 3] = x3;
      for (ptrdiff_t i = j + 4; i < columns; i++) x[i] -= first[i]*x0 + second[i]*x1 + third[i]*x2 + fourth[i]*x3;
      lower += 4*(columns - j) - 10;
   }
   for (; j < columns; j++) {
      for (ptrdiff_t i = j + 1; i < columns; i++) x[i] -= lower[i - j - 1]*x[j];
      lower += columns - j - 1;
   }
   return lower;
}

/* x := T^{-T} x, from the end of T. */
INLINE void solve_transposed(ptrdiff_t columns, const double *end, four *x)
{
   ptrdiff_t j = columns;

   for (; j >= 4; j -= 4) {
      const double *fourth, *third, *second, *first;
      four s0 = {0, 0, 0, 0}, s1 = s0, s2 = s0, s3 = s0;

      end -= 4*(columns - j) + 6;
      first = end - (j - 3);
      second = first + columns - j + 2;
      third = second + columns - j + 1;
      fourth = third + columns - j;
      for (ptrdiff_t i = j; i < columns; i++) {
         s0 += first[i]*x[i];
         s1 += second[i]*x[i];
         s2 += third[i]*x[i];
         s3 += fourth[i]*x[i];
      }
      x[j - 1] -= s3;
      x[j - 2] -= s2 + third[j - 1]*x[j - 1];
      x[j - 3] -= s1 + second[j - 1]*x[j - 1] + second[j - 2]*x[j - 2];
      x[j - 4] -= s0 + first[j - 1]*x[j - 1] + first[j - 2]*x[j - 2] + first[j - 3]*x[j - 3];
   }
   for (j = j - 1; j >= 0; j--) {
      end -= columns - j - 1;
      for (ptrdiff_t i = j + 1; i < columns; i++) x[j] -= end[i - j - 1]*x[i];
   }
}

INLINE void forward(ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, four *rows)
{
   const double *b = solve_triangle(columns, lower, x);
   ptrdiff_t j = 0;

   for (ptrdiff_t i = 0; i < below; i++) rows[i] = (four){0, 0, 0, 0};
   for (; j + 8 <= columns; j += 8) add_products(8, below, b + j*below, x + j, rows);
   if (columns & 4) add_products(4, below, b + j*below, x + j, rows);
   j += columns & 4;
   if (columns & 2) add_products(2, below, b + j*below, x + j, rows);
   j += columns & 2;
   if (columns & 1) add_products(1, below, b + j*below, x + j, rows);
}

INLINE void backward(ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, const four *rows)
{
   const double *b = lower + columns*(columns - 1)/2;
   ptrdiff_t j = 0;

   for (; j + 8 <= columns; j += 8) subtract_products(8, below, b + j*below, rows, x + j);
   if (columns & 4) subtract_products(4, below, b + j*below, rows, x + j);
   j += columns & 4;
   if (columns & 2) subtract_products(2, below, b + j*below, rows, x + j);
   j += columns & 2;
   if (columns & 1) subtract_products(1, below, b + j*below, rows, x + j);
   solve_transposed(columns, b, x);
}

WIDE static void forward_wide(ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, four *rows)
{
   forward(columns, below, lower, x, rows);
}

WIDE static void backward_wide(ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, const four *rows)
{
   backward(columns, below, lower, x, rows);
}

/* x := T^{-1} x, rows := B x. */
void kschur_forward_four(int columns, int below, const double *lower, double *x, double *rows)
{
   if (HAS_WIDE) {
      forward_wide(columns, below, lower, (four *)x, (four *)rows);
   } else {
      forward(columns, below, lower, (four *)x, (four *)rows);
   }
}

/* x := T^{-T} (x - B^T rows). */
void kschur_backward_four(int columns, int below, const double *lower, double *x, const double *rows)
{
   if (HAS_WIDE) {
      backward_wide(columns, below, lower, (four *)x, (const four *)rows);
   } else {
      backward(columns, below, lower, (four *)x, (const four *)rows);
   }
}
