/* Eigenvalues of an operator without a matrix: the inverse of the Laplacian on the unit square, 60 x 60 points and zero on the
 * edge, applied by sine transforms in one direction and tridiagonal systems in the other.
 *
 * Closed form: the eigenvalues of the Laplacian are 4 (sin^2(i pi/122) + sin^2(j pi/122)) 61^2, next to (i^2 + j^2) pi^2. */
#include <kschur.h>
#include <math.h>
#include <stdio.h>

enum { points = 60, modes = 4 };

/* The context of the operator; the sine transform is its own inverse. */
typedef struct {
   double sines[points][points];
} membrane;

/* The transform of each column of a field. */
static void transform(const membrane *m, const double field[points][points], double transformed[points][points])
{
   for (int i = 0; i < points; i++)
      for (int j = 0; j < points; j++) {
         transformed[i][j] = 0;
         for (int k = 0; k < points; k++) transformed[i][j] += m->sines[i][k] * field[k][j];
      }
}

/* Solves with the matrix that has d on its diagonal and -1 beside it. */
static void solve_tridiagonal(double d, double x[points])
{
   double pivot[points];

   pivot[0] = d;
   for (int i = 1; i < points; i++) {
      pivot[i] = d - 1 / pivot[i - 1];
      x[i] += x[i - 1] / pivot[i - 1];
   }
   x[points - 1] /= pivot[points - 1];
   for (int i = points - 2; i >= 0; i--) x[i] = (x[i] + x[i + 1]) / pivot[i];
}

/* y := C x, C the inverse of the Laplacian. */
static int apply(void *context, int64_t n, int64_t vectors, const double *x, double *y)
{
   const double pi = acos(-1.0);
   const membrane *m = context;
   double field[points][points], transformed[points][points];

   for (int64_t column = 0; column < vectors; column++, x += n, y += n) {
      for (int i = 0; i < points; i++)
         for (int j = 0; j < points; j++) field[i][j] = x[i * points + j];
      transform(m, (const double(*)[points])field, transformed);
      for (int i = 0; i < points; i++)
         solve_tridiagonal(2 + 4 * pow(sin((i + 1) * pi / (2 * (points + 1))), 2), transformed[i]);
      transform(m, (const double(*)[points])transformed, field);
      for (int i = 0; i < points; i++)
         for (int j = 0; j < points; j++) y[i * points + j] = field[i][j] / ((points + 1) * (points + 1));
   }
   return 0;
}

int main(void)
{
   const double pi = acos(-1.0);
   static membrane m;
   kschur_options *options = NULL;
   kschur_result *result = NULL;
   double values[2 * modes];
   char message[500] = "";
   int status, reason = KSCHUR_REASON_CONVERGED;

   for (int i = 0; i < points; i++)
      for (int j = 0; j < points; j++) m.sines[i][j] = sqrt(2.0 / (points + 1)) * sin((i + 1) * (j + 1) * pi / (points + 1));
   kschur_options_create(&options);
   kschur_options_set_modes(options, modes);
   kschur_result_create(&result);

   /* The largest eigenvalues of the inverse are the smallest ones of the Laplacian. */
   status = kschur_solve_real_operator(points * points, apply, &m, "largest-magnitude", options, result);
   if (status == KSCHUR_OK) status = kschur_result_get_reason(result, &reason);
   if (status == KSCHUR_OK && reason == KSCHUR_REASON_CONVERGED)
      status = kschur_result_get_eigenvalues(result, values, 2 * modes);
   if (status != KSCHUR_OK) {
      kschur_result_get_message(result, message, sizeof message);
      printf("%s\n", message);
   } else if (reason == KSCHUR_REASON_CONVERGED) {
      printf("eigenvalues");
      for (int j = 0; j < modes; j++) printf("%12.6f", 1 / values[2 * j]);
      printf("\n");
   } else {
      printf("not converged\n");
   }
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   return status != KSCHUR_OK || reason != KSCHUR_REASON_CONVERGED;
}
