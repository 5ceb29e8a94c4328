/* Products of a panel of rows of a tall real basis with single vectors, and with four at a time. Groups of columns and tiles of rows keep the sums in
   the cache, so that several products read the basis from memory once; BLAS would read it once for each.

   v: rows x columns, of an array whose columns are `lead` apart. */
#include <stddef.h>
#include <string.h>

#include "kschur_wide.h"

#define AT(p) (*(four *)(p))
#define FROM(p) (*(const four *)(p))

/* Rows of a tile that is read twice: a few hundred columns of it, and of the next one, fit in the cache; of one that is read
   once. Columns of a group. */
enum { read_twice = 128, read_once = 512, group = 8, cache_line = 8 };

/* Vectors at a time, and columns whose products with them are in registers. */
enum { sides = 4, sides_group = 3 };

/* sum(:, s) += V c(:, s) for a group of columns; `sums` and `columns` are constants after inlining. */
INLINE void add_group(int sums, int columns, int rows, ptrdiff_t lead, const double *v, const double *const *c,
                      double (*sum)[read_once])
{
   double factor[3][group];
   int i = 0;

   for (int s = 0; s < sums; s++)
      for (int j = 0; j < columns; j++) factor[s][j] = c[s][j];
   for (; i + 4 <= rows; i += 4) {
      four part[group];

      for (int j = 0; j < columns; j++) part[j] = FROM(v + j*lead + i);
      for (int s = 0; s < sums; s++) {
         four total = FROM(sum[s] + i);
         for (int j = 0; j < columns; j++) total += part[j]*factor[s][j];
         AT(sum[s] + i) = total;
      }
   }
   for (; i < rows; i++)
      for (int s = 0; s < sums; s++)
         for (int j = 0; j < columns; j++) sum[s][i] += v[j*lead + i]*factor[s][j];
}

/* sum(:, s) := V c(:, s) for all columns. */
INLINE void add_columns(int sums, int rows, int columns, ptrdiff_t lead, const double *v, const double *const *c,
                        double (*sum)[read_once])
{
   const double *at[3];
   int j = 0;

   for (int s = 0; s < sums; s++) {
      at[s] = c[s];
      memset(sum[s], 0, sizeof sum[s]);
   }
   for (; j + group <= columns; j += group) {
      add_group(sums, group, rows, lead, v + j*lead, at, sum);
      for (int s = 0; s < sums; s++) at[s] += group;
   }
   for (; j < columns; j++) {
      add_group(sums, 1, rows, lead, v + j*lead, at, sum);
      for (int s = 0; s < sums; s++) at[s]++;
   }
}

/* d += V^T y for a group of columns. */
INLINE void dot_group(int columns, int rows, ptrdiff_t lead, const double *v, const double *y, double *d)
{
   four sum[group];
   int i = 0;

   for (int j = 0; j < columns; j++) sum[j] = (four){0, 0, 0, 0};
   for (; i + 4 <= rows; i += 4)
      for (int j = 0; j < columns; j++) sum[j] += FROM(v + j*lead + i)*FROM(y + i);
   for (int j = 0; j < columns; j++) {
      double total = (sum[j][0] + sum[j][1]) + (sum[j][2] + sum[j][3]);
      for (int k = i; k < rows; k++) total += v[j*lead + k]*y[k];
      d[j] += total;
   }
}

/* d += V^T y for all columns; prefetches the next `ahead` rows. */
INLINE void dot_columns(int rows, int columns, ptrdiff_t lead, const double *v, const double *y, double *d, int ahead)
{
   int j = 0;

   for (; j + group <= columns; j += group) {
      for (int k = j; k < j + group; k++)
         for (int i = rows; i < rows + ahead; i += cache_line) __builtin_prefetch(v + k*lead + i, 0, 2);
      dot_group(group, rows, lead, v + j*lead, y, d + j);
   }
   for (; j < columns; j++) dot_group(1, rows, lead, v + j*lead, y, d + j);
}

/* D += V^T Y for a group of columns and four vectors. */
INLINE void dot_sides_group(int columns, int rows, ptrdiff_t lead, const double *v, ptrdiff_t lead_y, const double *y,
                            ptrdiff_t lead_d, double *d)
{
   four sum[sides_group][sides];
   int i = 0;

   for (int j = 0; j < columns; j++)
      for (int s = 0; s < sides; s++) sum[j][s] = (four){0, 0, 0, 0};
   for (; i + 4 <= rows; i += 4) {
      four part[sides_group];

      for (int j = 0; j < columns; j++) part[j] = FROM(v + j*lead + i);
      for (int s = 0; s < sides; s++) {
         four side = FROM(y + s*lead_y + i);
         for (int j = 0; j < columns; j++) sum[j][s] += part[j]*side;
      }
   }
   for (int j = 0; j < columns; j++)
      for (int s = 0; s < sides; s++) {
         double total = (sum[j][s][0] + sum[j][s][1]) + (sum[j][s][2] + sum[j][s][3]);
         for (int k = i; k < rows; k++) total += v[j*lead + k]*y[s*lead_y + k];
         d[s*lead_d + j] += total;
      }
}

/* D += V^T Y for all columns and four vectors. */
INLINE void dot_sides(int rows, int columns, ptrdiff_t lead, const double *v, ptrdiff_t lead_y, const double *y,
                      ptrdiff_t lead_d, double *d)
{
   int j = 0;

   for (; j + sides_group <= columns; j += sides_group)
      dot_sides_group(sides_group, rows, lead, v + j*lead, lead_y, y, lead_d, d + j);
   for (; j < columns; j++) dot_sides_group(1, rows, lead, v + j*lead, lead_y, y, lead_d, d + j);
}

/* Y -= V C for a pair of columns, or one, and four vectors. */
INLINE void subtract_sides_group(int columns, int rows, ptrdiff_t lead, const double *v, ptrdiff_t lead_c, const double *c,
                                 ptrdiff_t lead_y, double *y)
{
   double factor[2][sides];
   int i = 0;

   for (int j = 0; j < columns; j++)
      for (int s = 0; s < sides; s++) factor[j][s] = c[s*lead_c + j];
   for (; i + 4 <= rows; i += 4) {
      four part[2];

      for (int j = 0; j < columns; j++) part[j] = FROM(v + j*lead + i);
      for (int s = 0; s < sides; s++) {
         four side = FROM(y + s*lead_y + i);
         for (int j = 0; j < columns; j++) side -= part[j]*factor[j][s];
         AT(y + s*lead_y + i) = side;
      }
   }
   for (; i < rows; i++)
      for (int s = 0; s < sides; s++)
         for (int j = 0; j < columns; j++) y[s*lead_y + i] -= v[j*lead + i]*factor[j][s];
}

/* Y -= V C for all columns and four vectors. */
INLINE void subtract_sides(int rows, int columns, ptrdiff_t lead, const double *v, ptrdiff_t lead_c, const double *c,
                           ptrdiff_t lead_y, double *y)
{
   int j = 0;

   for (; j + 2 <= columns; j += 2) subtract_sides_group(2, rows, lead, v + j*lead, lead_c, c + j, lead_y, y);
   if (j < columns) subtract_sides_group(1, rows, lead, v + j*lead, lead_c, c + j, lead_y, y);
}

INLINE int at_most(int most, int rows)
{
   return rows < most ? rows : most;
}

INLINE void inner(int rows, int columns, ptrdiff_t lead, const double *v, const double *y, double *d)
{
   memset(d, 0, columns*sizeof *d);
   dot_columns(rows, columns, lead, v, y, d, 0);
}

INLINE void project(int rows, int columns, ptrdiff_t lead, const double *v, const double *c, double *y, double *d)
{
   double sum[1][read_once];

   memset(d, 0, columns*sizeof *d);
   for (int i = 0; i < rows; i += read_twice) {
      int part = at_most(read_twice, rows - i);

      add_columns(1, part, columns, lead, v + i, &c, sum);
      for (int k = 0; k < part; k++) y[i + k] -= sum[0][k];
      dot_columns(part, columns, lead, v + i, y + i, d, at_most(read_twice, rows - i - part));
   }
}

INLINE void complete(int rows, int columns, ptrdiff_t lead, double *v, const double *c, double length, const double *a,
                     ptrdiff_t lead_a, double *x, ptrdiff_t lead_x)
{
   const double *factors[3] = {c, a, a + lead_a};
   double sum[3][read_once];

   for (int i = 0; i < rows; i += read_once) {
      int part = at_most(read_once, rows - i);
      double *y = v + columns*lead + i;

      add_columns(3, part, columns, lead, v + i, factors, sum);
      for (int k = 0; k < part; k++) {
         y[k] = (y[k] - sum[0][k])/length;
         x[i + k] = sum[1][k] + y[k]*a[columns];
         x[lead_x + i + k] = sum[2][k] + y[k]*a[lead_a + columns];
      }
   }
}

INLINE void inner_sides(int rows, int columns, ptrdiff_t lead, const double *v, ptrdiff_t lead_y, const double *y,
                        ptrdiff_t lead_d, double *d)
{
   for (int s = 0; s < sides; s++) memset(d + s*lead_d, 0, columns*sizeof *d);
   for (int i = 0; i < rows; i += read_twice)
      dot_sides(at_most(read_twice, rows - i), columns, lead, v + i, lead_y, y + i, lead_d, d);
}

INLINE void project_sides(int rows, int columns, ptrdiff_t lead, const double *v, const double *c, ptrdiff_t lead_y,
                          double *y, ptrdiff_t lead_d, double *d)
{
   for (int s = 0; s < sides; s++) memset(d + s*lead_d, 0, columns*sizeof *d);
   for (int i = 0; i < rows; i += read_twice) {
      int part = at_most(read_twice, rows - i);

      subtract_sides(part, columns, lead, v + i, lead_d, c, lead_y, y + i);
      dot_sides(part, columns, lead, v + i, lead_y, y + i, lead_d, d);
   }
}

WIDE static void inner_sides_wide(int rows, int columns, ptrdiff_t lead, const double *v, ptrdiff_t lead_y, const double *y,
                                  ptrdiff_t lead_d, double *d)
{
   inner_sides(rows, columns, lead, v, lead_y, y, lead_d, d);
}

WIDE static void project_sides_wide(int rows, int columns, ptrdiff_t lead, const double *v, const double *c, ptrdiff_t lead_y,
                                    double *y, ptrdiff_t lead_d, double *d)
{
   project_sides(rows, columns, lead, v, c, lead_y, y, lead_d, d);
}

WIDE static void inner_wide(int rows, int columns, ptrdiff_t lead, const double *v, const double *y, double *d)
{
   inner(rows, columns, lead, v, y, d);
}

WIDE static void project_wide(int rows, int columns, ptrdiff_t lead, const double *v, const double *c, double *y, double *d)
{
   project(rows, columns, lead, v, c, y, d);
}

WIDE static void complete_wide(int rows, int columns, ptrdiff_t lead, double *v, const double *c, double length,
                               const double *a, ptrdiff_t lead_a, double *x, ptrdiff_t lead_x)
{
   complete(rows, columns, lead, v, c, length, a, lead_a, x, lead_x);
}

/* d := V^T y. */
void kschur_panel_inner(int rows, int columns, int lead, const double *v, const double *y, double *d)
{
   if (HAS_WIDE) {
      inner_wide(rows, columns, lead, v, y, d);
   } else {
      inner(rows, columns, lead, v, y, d);
   }
}

/* y := y - V c, then d := V^T y with the new y. */
void kschur_panel_project(int rows, int columns, int lead, const double *v, const double *c, double *y, double *d)
{
   if (HAS_WIDE) {
      project_wide(rows, columns, lead, v, c, y, d);
   } else {
      project(rows, columns, lead, v, c, y, d);
   }
}

/* y := (y - V c)/length, y the column after those of V, then X := [V y] A with two columns; those of A are lead_a apart. */
void kschur_panel_complete(int rows, int columns, int lead, double *v, const double *c, double length, const double *a,
                           int lead_a, double *x, int lead_x)
{
   if (HAS_WIDE) {
      complete_wide(rows, columns, lead, v, c, length, a, lead_a, x, lead_x);
   } else {
      complete(rows, columns, lead, v, c, length, a, lead_a, x, lead_x);
   }
}

/* D := V^T Y for four vectors; those of Y are lead_y apart, those of D lead_d. */
void kschur_panel_inner_sides(int rows, int columns, int lead, const double *v, int lead_y, const double *y, int lead_d, double *d)
{
   if (HAS_WIDE) {
      inner_sides_wide(rows, columns, lead, v, lead_y, y, lead_d, d);
   } else {
      inner_sides(rows, columns, lead, v, lead_y, y, lead_d, d);
   }
}

/* Y := Y - V C, then D := V^T Y with the new Y, for four vectors; those of C and D are lead_d apart. */
void kschur_panel_project_sides(int rows, int columns, int lead, const double *v, int lead_d, const double *c, int lead_y,
                                double *y, double *d)
{
   if (HAS_WIDE) {
      project_sides_wide(rows, columns, lead, v, c, lead_y, y, lead_d, d);
   } else {
      project_sides(rows, columns, lead, v, c, lead_y, y, lead_d, d);
   }
}
