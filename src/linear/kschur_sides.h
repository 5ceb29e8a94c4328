/* One supernode of L with right-hand sides side by side, as many as a vector of the processor has or twice as many, each entry of L
   read once for all of them. BLAS copies a block before it multiplies, which for so few columns takes as long as the products. A
   right-hand side has the same digits in one vector and among two.

   The including file defines ENTRY and VECTOR, the types of an entry of L and of SIDES sides; TIMES(l, x), their product, and
   ADDED(y, l, x), y + l x; and FORWARD and BACKWARD, the names of the procedures.

   lower: the triangle below the unit diagonal, column by column without gaps, behind it the block B, below x columns.
   x: sides x columns. rows: sides x below. groups: how many vectors the sides are, a number that the compiler knows. */
#include <stddef.h>

/* rows := rows + B x for so many columns, a number that the compiler knows. */
INLINE void add_products(int columns, int groups, ptrdiff_t below, const ENTRY *b, const VECTOR *restrict x,
   VECTOR *restrict rows)
{
   for (ptrdiff_t i = 0; i < below; i++) {
      VECTOR sum[2];

      for (int s = 0; s < groups; s++) sum[s] = rows[groups*i + s];
      for (int j = 0; j < columns; j++)
         for (int s = 0; s < groups; s++) sum[s] = ADDED(sum[s], b[i + j*below], x[groups*j + s]);
      for (int s = 0; s < groups; s++) rows[groups*i + s] = sum[s];
   }
}

/* x := x - B^T rows, likewise; columns x groups are eight at most. */
INLINE void subtract_products(int columns, int groups, ptrdiff_t below, const ENTRY *b, const VECTOR *restrict rows,
   VECTOR *restrict x)
{
   VECTOR sums[8];

   for (int j = 0; j < groups*columns; j++) sums[j] = (VECTOR){0};
   for (ptrdiff_t i = 0; i < below; i++)
      for (int j = 0; j < columns; j++)
         for (int s = 0; s < groups; s++)
            sums[groups*j + s] = ADDED(sums[groups*j + s], b[i + j*below], rows[groups*i + s]);
   for (int j = 0; j < groups*columns; j++) x[j] -= sums[j];
}

/* x := T^{-1} x for one of the groups. */
INLINE void solve_triangle(ptrdiff_t columns, int groups, const ENTRY *lower, VECTOR *x)
{
   ptrdiff_t j = 0;

   for (; j + 4 <= columns; j += 4) {
      /* So that each is counted from row 0. */
      const ENTRY *first = lower - (j + 1), *second = first + columns - j - 2, *third = second + columns - j - 3;
      const ENTRY *fourth = third + columns - j - 4;
      VECTOR x0 = x[groups*j], x1 = x[groups*(j + 1)], x2 = x[groups*(j + 2)], x3 = x[groups*(j + 3)];

      x1 -= TIMES(first[j + 1], x0);
      x2 -= TIMES(first[j + 2], x0) + TIMES(second[j + 2], x1);
      x3 -= TIMES(first[j + 3], x0) + TIMES(second[j + 3], x1) + TIMES(third[j + 3], x2);
      x[groups*(j + 1)] = x1;
      x[groups*(j + 2)] = x2;
      x[groups*(j + 3)] = x3;
      for (ptrdiff_t i = j + 4; i < columns; i++)
         x[groups*i] -= TIMES(first[i], x0) + TIMES(second[i], x1) + TIMES(third[i], x2) + TIMES(fourth[i], x3);
      lower += 4*(columns - j) - 10;
   }
   for (; j < columns; j++) {
      for (ptrdiff_t i = j + 1; i < columns; i++) x[groups*i] -= TIMES(lower[i - j - 1], x[groups*j]);
      lower += columns - j - 1;
   }
}

/* x := T^{-T} x, likewise, from the end of T. */
INLINE void solve_transposed(ptrdiff_t columns, int groups, const ENTRY *end, VECTOR *x)
{
   ptrdiff_t j = columns;

   for (; j >= 4; j -= 4) {
      const ENTRY *fourth, *third, *second, *first;
      VECTOR s0 = {0}, s1 = s0, s2 = s0, s3 = s0;

      end -= 4*(columns - j) + 6;
      first = end - (j - 3);
      second = first + columns - j + 2;
      third = second + columns - j + 1;
      fourth = third + columns - j;
      for (ptrdiff_t i = j; i < columns; i++) {
         s0 = ADDED(s0, first[i], x[groups*i]);
         s1 = ADDED(s1, second[i], x[groups*i]);
         s2 = ADDED(s2, third[i], x[groups*i]);
         s3 = ADDED(s3, fourth[i], x[groups*i]);
      }
      x[groups*(j - 1)] -= s3;
      x[groups*(j - 2)] -= s2 + TIMES(third[j - 1], x[groups*(j - 1)]);
      x[groups*(j - 3)] -= s1 + TIMES(second[j - 1], x[groups*(j - 1)]) + TIMES(second[j - 2], x[groups*(j - 2)]);
      x[groups*(j - 4)] -= s0 + TIMES(first[j - 1], x[groups*(j - 1)]) + TIMES(first[j - 2], x[groups*(j - 2)]) +
         TIMES(first[j - 3], x[groups*(j - 3)]);
   }
   for (j = j - 1; j >= 0; j--) {
      end -= columns - j - 1;
      for (ptrdiff_t i = j + 1; i < columns; i++) x[groups*j] -= TIMES(end[i - j - 1], x[groups*i]);
   }
}

INLINE void forward(int groups, ptrdiff_t columns, ptrdiff_t below, const ENTRY *lower, VECTOR *x, VECTOR *rows)
{
   const ENTRY *b = lower + columns*(columns - 1)/2;
   const int most = 8/groups;
   ptrdiff_t j = 0;

   for (int s = 0; s < groups; s++) solve_triangle(columns, groups, lower, x + s);
   for (ptrdiff_t i = 0; i < groups*below; i++) rows[i] = (VECTOR){0};
   for (; j + most <= columns; j += most) add_products(most, groups, below, b + j*below, x + groups*j, rows);
   for (int few = most/2; few > 0; few /= 2)
      if ((columns - j) & few) {
         if (few == 4) add_products(4, groups, below, b + j*below, x + groups*j, rows);
         if (few == 2) add_products(2, groups, below, b + j*below, x + groups*j, rows);
         if (few == 1) add_products(1, groups, below, b + j*below, x + groups*j, rows);
         j += few;
      }
}

INLINE void backward(int groups, ptrdiff_t columns, ptrdiff_t below, const ENTRY *lower, VECTOR *x, const VECTOR *rows)
{
   const ENTRY *b = lower + columns*(columns - 1)/2;
   const int most = 8/groups;
   ptrdiff_t j = 0;

   for (; j + most <= columns; j += most) subtract_products(most, groups, below, b + j*below, rows, x + groups*j);
   for (int few = most/2; few > 0; few /= 2)
      if ((columns - j) & few) {
         if (few == 4) subtract_products(4, groups, below, b + j*below, rows, x + groups*j);
         if (few == 2) subtract_products(2, groups, below, b + j*below, rows, x + groups*j);
         if (few == 1) subtract_products(1, groups, below, b + j*below, rows, x + groups*j);
         j += few;
      }
   for (int s = 0; s < groups; s++) solve_transposed(columns, groups, b, x + s);
}

INLINE void forward_sides(int sides, ptrdiff_t columns, ptrdiff_t below, const ENTRY *lower, VECTOR *x, VECTOR *rows)
{
   if (sides == SIDES) {
      forward(1, columns, below, lower, x, rows);
   } else {
      forward(2, columns, below, lower, x, rows);
   }
}

INLINE void backward_sides(int sides, ptrdiff_t columns, ptrdiff_t below, const ENTRY *lower, VECTOR *x, const VECTOR *rows)
{
   if (sides == SIDES) {
      backward(1, columns, below, lower, x, rows);
   } else {
      backward(2, columns, below, lower, x, rows);
   }
}

WIDE static void forward_wide(int sides, ptrdiff_t columns, ptrdiff_t below, const ENTRY *lower, VECTOR *x, VECTOR *rows)
{
   forward_sides(sides, columns, below, lower, x, rows);
}

WIDE static void backward_wide(int sides, ptrdiff_t columns, ptrdiff_t below, const ENTRY *lower, VECTOR *x, const VECTOR *rows)
{
   backward_sides(sides, columns, below, lower, x, rows);
}

/* x := T^{-1} x, rows := B x. */
void FORWARD(int sides, int columns, int below, const ENTRY *lower, VECTOR *x, VECTOR *rows)
{
   if (HAS_WIDE) {
      forward_wide(sides, columns, below, lower, x, rows);
   } else {
      forward_sides(sides, columns, below, lower, x, rows);
   }
}

/* x := T^{-T} (x - B^T rows). */
void BACKWARD(int sides, int columns, int below, const ENTRY *lower, VECTOR *x, const VECTOR *rows)
{
   if (HAS_WIDE) {
      backward_wide(sides, columns, below, lower, x, rows);
   } else {
      backward_sides(sides, columns, below, lower, x, rows);
   }
}
