/* Modes with a linear solver of one's own, here dense LU with pivots: a chain of 20 equal masses between walls, 1 kg and
 * 100 N/m each, with damping 0.02 K, and a constraint that keeps the mean of the four middle masses at rest.
 *
 * Closed form: the constraint does not disturb the second mode of the chain, which is antisymmetric:
 * omega^2 = 400 sin^2(pi/21), damping ratio 0.01 omega. */
#include <kschur.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { n = 20 };

typedef struct {
   double *lu;
   int64_t *pivot;
} dense_factors;

static void release(void *context, void *factors)
{
   dense_factors *f = factors;

   (void)context;
   free(f->lu);
   free(f->pivot);
   free(f);
}

static void exchange(double *x, int64_t i, int64_t j)
{
   double swapped = x[i];

   x[i] = x[j];
   x[j] = swapped;
}

/* Row by row, P A = L U. */
static int factorize(void *context, int64_t order, int64_t entries, const int32_t *row_start, const int32_t *column,
                     const double *value, int symmetric, void **factors)
{
   dense_factors *f = malloc(sizeof *f);
   int *factorizations = context;

   (void)entries, (void)symmetric;
   if (!f) return KSCHUR_ERROR_MEMORY;
   f->lu = calloc(order * order, sizeof *f->lu);
   f->pivot = malloc(order * sizeof *f->pivot);
   if (!f->lu || !f->pivot) {
      release(NULL, f);
      return KSCHUR_ERROR_MEMORY;
   }
   for (int64_t i = 0; i < order; i++)
      for (int64_t k = row_start[i]; k < row_start[i + 1]; k++) f->lu[i * order + column[k]] = value[k];
   for (int64_t j = 0; j < order; j++) {
      int64_t p = j;
      for (int64_t i = j + 1; i < order; i++)
         if (fabs(f->lu[i * order + j]) > fabs(f->lu[p * order + j])) p = i;
      f->pivot[j] = p;
      if (f->lu[p * order + j] == 0) {
         /* The library tries another shift then. */
         release(NULL, f);
         return KSCHUR_ERROR_SINGULAR;
      }
      for (int64_t k = 0; k < order; k++) exchange(f->lu, j * order + k, p * order + k);
      for (int64_t i = j + 1; i < order; i++) {
         f->lu[i * order + j] /= f->lu[j * order + j];
         for (int64_t k = j + 1; k < order; k++) f->lu[i * order + k] -= f->lu[i * order + j] * f->lu[j * order + k];
      }
   }
   ++*factorizations;
   *factors = f;
   return 0;
}

/* x := U^-1 L^-1 P x, or its transpose x := P^T L^-T U^-T x. */
static int solve(void *context, void *factors, int adjoint, int64_t order, int64_t vectors, double *x)
{
   const dense_factors *f = factors;

   (void)context;
   for (int64_t j = 0; j < vectors; j++, x += order) {
      if (!adjoint) {
         for (int64_t i = 0; i < order; i++) exchange(x, i, f->pivot[i]);
         for (int64_t i = 0; i < order; i++)
            for (int64_t k = 0; k < i; k++) x[i] -= f->lu[i * order + k] * x[k];
         for (int64_t i = order - 1; i >= 0; i--) {
            for (int64_t k = i + 1; k < order; k++) x[i] -= f->lu[i * order + k] * x[k];
            x[i] /= f->lu[i * order + i];
         }
      } else {
         for (int64_t i = 0; i < order; i++) {
            for (int64_t k = 0; k < i; k++) x[i] -= f->lu[k * order + i] * x[k];
            x[i] /= f->lu[i * order + i];
         }
         for (int64_t i = order - 1; i >= 0; i--)
            for (int64_t k = i + 1; k < order; k++) x[i] -= f->lu[k * order + i] * x[k];
         for (int64_t i = order - 1; i >= 0; i--) exchange(x, i, f->pivot[i]);
      }
   }
   return 0;
}

/* A tridiagonal matrix of the chain. */
static int set_chain_matrix(kschur_problem *problem, int matrix, double diagonal, double beside)
{
   int32_t row[3 * n], column[3 * n];
   double value[3 * n];
   int64_t entries = 0;

   for (int i = 0; i < n; i++)
      for (int j = i - 1; j <= i + 1; j++) {
         if (j < 0 || j >= n) continue;
         row[entries] = i;
         column[entries] = j;
         value[entries++] = i == j ? diagonal : beside;
      }
   return kschur_problem_set_triplets(problem, matrix, n, n, entries, 0, row, column, value);
}

int main(void)
{
   const int32_t row[] = {0, 0, 0, 0}, middle[] = {8, 9, 10, 11};
   const double ones[] = {1, 1, 1, 1};
   kschur_problem *problem = NULL;
   kschur_options *options = NULL;
   kschur_result *result = NULL;
   double frequency, damping_ratio;
   char inner[200] = "", message[500] = "";
   int status, factorizations = 0;

   kschur_problem_create(&problem);
   set_chain_matrix(problem, KSCHUR_MASS, 1, 0);
   set_chain_matrix(problem, KSCHUR_STIFFNESS, 200, -100);
   set_chain_matrix(problem, KSCHUR_DAMPING, 4, -2);
   kschur_problem_set_triplets(problem, KSCHUR_CONSTRAINTS, 1, n, 4, 0, row, middle, ones);
   kschur_options_create(&options);
   kschur_options_set_modes(options, 1);
   kschur_options_set_real_solver(options, factorize, solve, release, &factorizations);
   kschur_result_create(&result);

   status = kschur_solve(problem, options, result);
   if (status == KSCHUR_OK) status = kschur_result_get_frequencies_hz(result, &frequency, 1);
   if (status == KSCHUR_OK) status = kschur_result_get_damping_ratios(result, &damping_ratio, 1);
   if (status == KSCHUR_OK) {
      kschur_result_get_inner(result, inner, sizeof inner);
      printf("frequency %9.6f Hz, damping ratio %9.6f\n", frequency, damping_ratio);
      printf("solved by %s, %d matrices factored\n", inner, factorizations);
   } else {
      kschur_result_get_message(result, message, sizeof message);
      printf("%s\n", message);
   }
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
   return status;
}
