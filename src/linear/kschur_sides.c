/* One supernode of L with four right-hand sides side by side, or twice four, each entry of L read once for all of them. BLAS
   copies a block before it multiplies, which for so few columns takes as long as the products. A right-hand side has the same
   digits among four and among eight.

   lower: the triangle below the unit diagonal, column by column without gaps, behind it the block B, below x columns.
   x: sides x columns. rows: sides x below. fours: how many fours they are, a number that the compiler knows. */
#include <stddef.h>

#include "../base/kschur_wide.h"

/* rows := rows + B x for so many columns, a number that the compiler knows. */
INLINE void add_products(int columns, int fours, ptrdiff_t below, const double *b, const four *restrict x, four *restrict rows)
{
   for (ptrdiff_t i = 0; i < below; i++) {
      four sum[2];

      for (int s = 0; s < fours; s++) sum[s] = rows[fours*i + s];
      for (int j = 0; j < columns; j++)
         for (int s = 0; s < fours; s++) sum[s] += b[i + j*below]*x[fours*j + s];
      for (int s = 0; s < fours; s++) rows[fours*i + s] = sum[s];
   }
}

/* x := x - B^T rows, likewise; columns x fours are eight at most. */
INLINE void subtract_products(int columns, int fours, ptrdiff_t below, const double *b, const four *restrict rows,
   four *restrict x)
{
   four sums[8];

   for (int j = 0; j < fours*columns; j++) sums[j] = (four){0, 0, 0, 0};
   for (ptrdiff_t i = 0; i < below; i++)
      for (int j = 0; j < columns; j++)
         for (int s = 0; s < fours; s++) sums[fours*j + s] += b[i + j*below]*rows[fours*i + s];
   for (int j = 0; j < fours*columns; j++) x[j] -= sums[j];
}

/* x := T^{-1} x for four of the sides, of which there are so many fours. */
INLINE void solve_triangle(ptrdiff_t columns, int fours, const double *lower, four *x)
{
   ptrdiff_t j = 0;

   for (; j + 4 <= columns; j += 4) {
      /* So that each is counted from row 0. */
      const double *first = lower - (j + 1), *second = first + columns - j - 2, *third = second + columns - j - 3;
      const double *fourth = third + columns - j - 4;
      four x0 = x[fours*j], x1 = x[fours*(j + 1)], x2 = x[fours*(j + 2)], x3 = x[fours*(j + 3)];

      x1 -= first[j + 1]*x0;
      x2 -= first[j + 2]*x0 + second[j + 2]*x1;
      x3 -= first[j + 3]*x0 + second[j + 3]*x1 + third[j + 3]*x2;
      x[fours*(j + 1)] = x1;
      x[fours*(j + 2)] = x2;
      x[fours*(j + 3)] = x3;
      for (ptrdiff_t i = j + 4; i < columns; i++) x[fours*i] -= first[i]*x0 + second[i]*x1 + third[i]*x2 + fourth[i]*x3;
      lower += 4*(columns - j) - 10;
   }
   for (; j < columns; j++) {
      for (ptrdiff_t i = j + 1; i < columns; i++) x[fours*i] -= lower[i - j - 1]*x[fours*j];
      lower += columns - j - 1;
   }
}

/* x := T^{-T} x, likewise, from the end of T. */
INLINE void solve_transposed(ptrdiff_t columns, int fours, const double *end, four *x)
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
         s0 += first[i]*x[fours*i];
         s1 += second[i]*x[fours*i];
         s2 += third[i]*x[fours*i];
         s3 += fourth[i]*x[fours*i];
      }
      x[fours*(j - 1)] -= s3;
      x[fours*(j - 2)] -= s2 + third[j - 1]*x[fours*(j - 1)];
      x[fours*(j - 3)] -= s1 + second[j - 1]*x[fours*(j - 1)] + second[j - 2]*x[fours*(j - 2)];
      x[fours*(j - 4)] -= s0 + first[j - 1]*x[fours*(j - 1)] + first[j - 2]*x[fours*(j - 2)] + first[j - 3]*x[fours*(j - 3)];
   }
   for (j = j - 1; j >= 0; j--) {
      end -= columns - j - 1;
      for (ptrdiff_t i = j + 1; i < columns; i++) x[fours*j] -= end[i - j - 1]*x[fours*i];
   }
}

INLINE void forward(int fours, ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, four *rows)
{
   const double *b = lower + columns*(columns - 1)/2;
   const int most = 8/fours;
   ptrdiff_t j = 0;

   for (int s = 0; s < fours; s++) solve_triangle(columns, fours, lower, x + s);
   for (ptrdiff_t i = 0; i < fours*below; i++) rows[i] = (four){0, 0, 0, 0};
   for (; j + most <= columns; j += most) add_products(most, fours, below, b + j*below, x + fours*j, rows);
   for (int few = most/2; few > 0; few /= 2)
      if ((columns - j) & few) {
         if (few == 4) add_products(4, fours, below, b + j*below, x + fours*j, rows);
         if (few == 2) add_products(2, fours, below, b + j*below, x + fours*j, rows);
         if (few == 1) add_products(1, fours, below, b + j*below, x + fours*j, rows);
         j += few;
      }
}

INLINE void backward(int fours, ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, const four *rows)
{
   const double *b = lower + columns*(columns - 1)/2;
   const int most = 8/fours;
   ptrdiff_t j = 0;

   for (; j + most <= columns; j += most) subtract_products(most, fours, below, b + j*below, rows, x + fours*j);
   for (int few = most/2; few > 0; few /= 2)
      if ((columns - j) & few) {
         if (few == 4) subtract_products(4, fours, below, b + j*below, rows, x + fours*j);
         if (few == 2) subtract_products(2, fours, below, b + j*below, rows, x + fours*j);
         if (few == 1) subtract_products(1, fours, below, b + j*below, rows, x + fours*j);
         j += few;
      }
   for (int s = 0; s < fours; s++) solve_transposed(columns, fours, b, x + s);
}

INLINE void forward_sides(int sides, ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, four *rows)
{
   if (sides == 4) {
      forward(1, columns, below, lower, x, rows);
   } else {
      forward(2, columns, below, lower, x, rows);
   }
}

INLINE void backward_sides(int sides, ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, const four *rows)
{
   if (sides == 4) {
      backward(1, columns, below, lower, x, rows);
   } else {
      backward(2, columns, below, lower, x, rows);
   }
}

WIDE static void forward_wide(int sides, ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, four *rows)
{
   forward_sides(sides, columns, below, lower, x, rows);
}

WIDE static void backward_wide(int sides, ptrdiff_t columns, ptrdiff_t below, const double *lower, four *x, const four *rows)
{
   backward_sides(sides, columns, below, lower, x, rows);
}

/* x := T^{-1} x, rows := B x for four sides or eight. */
void kschur_forward_sides(int sides, int columns, int below, const double *lower, double *x, double *rows)
{
   if (HAS_WIDE) {
      forward_wide(sides, columns, below, lower, (four *)x, (four *)rows);
   } else {
      forward_sides(sides, columns, below, lower, (four *)x, (four *)rows);
   }
}

/* x := T^{-T} (x - B^T rows), likewise. */
void kschur_backward_sides(int sides, int columns, int below, const double *lower, double *x, const double *rows)
{
   if (HAS_WIDE) {
      backward_wide(sides, columns, below, lower, (four *)x, (const four *)rows);
   } else {
      backward_sides(sides, columns, below, lower, (four *)x, (const four *)rows);
   }
}
