/* A caller's progress report, operators and linear solvers, also where they fail. */
#include <complex.h>

#include "models.h"

/* ---- Progress ---- */

typedef struct {
   int calls, cancel_at;
   int64_t last_converged, wanted;
} watch;

static int progress(void *context, int64_t restart, int64_t converged, int64_t wanted, double residual)
{
   watch *seen = context;

   CHECK(restart >= 0 && converged >= 0 && wanted > 0 && residual >= 0);
   seen->calls++;
   seen->last_converged = converged;
   seen->wanted = wanted;
   return seen->calls == seen->cancel_at;
}

static void a_progress_report_can_cancel(void)
{
   kschur_problem *problem = new_chain_with_dashpot(100, 5);
   kschur_options *options = new_options(8);
   kschur_result *result = new_result();
   watch seen = {0, -1, 0, 0};
   int64_t found;
   int reason, needed;

   CHECK_OK(kschur_options_set_progress(options, progress, &seen));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CONVERGED);
   needed = seen.calls;
   CHECK(needed > 2);

   seen.calls = 0;
   seen.cancel_at = 1;
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK(seen.calls < needed);
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CANCELLED);
   CHECK_OK(kschur_result_get_modes(result, &found, NULL));
   CHECK(found < 8);

   seen.calls = 0;
   CHECK_OK(kschur_options_set_progress(options, NULL, NULL));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK(seen.calls == 0);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

typedef struct {
   int asked, last;
} stopwatch;

static int stop(void *context)
{
   stopwatch *seen = context;

   return ++seen->asked >= seen->last;
}

static void a_stop_is_asked_in_every_phase(void)
{
   kschur_problem *problem = new_chain_with_dashpot(100, 5);
   kschur_options *options = new_options(8);
   kschur_result *result = new_result();
   watch reports = {0, -1, 0, 0};
   stopwatch seen = {0, 1 << 30};
   int reason, needed;

   CHECK_OK(kschur_options_set_progress(options, progress, &reports));
   CHECK_OK(kschur_options_set_stop(options, stop, &seen));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CONVERGED && seen.asked > reports.calls);
   needed = seen.asked;
   for (int k = 1; k <= needed; k++) {
      seen = (stopwatch){0, k};
      reports.calls = 0;
      CHECK_OK(kschur_solve(problem, options, result));
      CHECK_OK(kschur_result_get_reason(result, &reason));
      CHECK(reason == KSCHUR_REASON_CANCELLED && seen.asked == k && (k > 1 || reports.calls == 0));
   }

   CHECK_OK(kschur_options_set_stop(options, NULL, NULL));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CONVERGED);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

/* Solves a problem of its own in the middle of another one's iteration. */
static int solve_another(void *context, int64_t restart, int64_t converged, int64_t wanted, double residual)
{
   kschur_options *options = context;
   kschur_problem *problem = new_chain_with_dashpot(30, 1);
   kschur_result *result = new_result();
   double eigenvalue[2];
   int status;

   (void)restart, (void)converged, (void)wanted, (void)residual;
   status = kschur_solve(problem, options, result);
   if (status == KSCHUR_OK) CHECK_OK(kschur_result_get_eigenvalues(result, eigenvalue, 2));
   if (status != KSCHUR_OK) CHECK_MESSAGE(result, result, "ARPACK is iterating in this thread already");
   kschur_problem_destroy(&problem);
   kschur_result_destroy(&result);
   return status;
}

static void a_callback_may_solve(void)
{
   kschur_problem *problem = new_chain_with_dashpot(100, 5);
   kschur_options *outer = new_options(8), *inner = new_options(1);
   kschur_result *result = new_result();
   double alone[16], disturbed[16];
   int reason;

   CHECK_OK(kschur_solve(problem, outer, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, alone, 16));
   CHECK_OK(kschur_options_set_progress(outer, solve_another, inner));
   CHECK_OK(kschur_solve(problem, outer, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, disturbed, 16));
   CHECK(memcmp(alone, disturbed, sizeof alone) == 0);

   CHECK_OK(kschur_options_set_method(outer, "arpack"));
   CHECK_OK(kschur_options_set_method(inner, "arpack"));
   CHECK_OK(kschur_solve(problem, outer, result));
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CANCELLED);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&outer);
   kschur_options_destroy(&inner);
   kschur_result_destroy(&result);
}

/* ---- Operators ---- */

typedef struct {
   int applications, fail_at;
} operator_context;

/* The second difference, of eigenvalues 4 sin^2(j pi / (2 (n + 1))). */
static int difference(void *context, int64_t n, int64_t vectors, const double *x, double *y)
{
   operator_context *own = context;

   if (++own->applications == own->fail_at) return 42;
   for (int64_t j = 0; j < vectors; j++, x += n, y += n)
      for (int64_t i = 0; i < n; i++)
         y[i] = 2 * x[i] - (i > 0 ? x[i - 1] : 0) - (i < n - 1 ? x[i + 1] : 0);
   return 0;
}

/* i times a shift, of eigenvalues i exp(2 pi i j / n), plus 3 times the identity. */
static int cycle(void *context, int64_t n, int64_t vectors, const double *x, double *y)
{
   operator_context *own = context;

   own->applications++;
   for (int64_t j = 0; j < vectors; j++, x += 2 * n, y += 2 * n)
      for (int64_t i = 0; i < n; i++) {
         int64_t next = (i + 1) % n;
         y[2 * i] = 3 * x[2 * i] - x[2 * next + 1];
         y[2 * i + 1] = 3 * x[2 * i + 1] + x[2 * next];
      }
   return 0;
}

static void operators_without_a_matrix(void)
{
   enum { n = 60 };
   kschur_options *options = new_options(3);
   kschur_result *result = new_result();
   operator_context own = {0, -1};
   double complex mu[4], x[3 * n];
   double norm = 0;
   int64_t applications;
   int reason;

   CHECK_OK(kschur_solve_real_operator(n, difference, &own, "largest-magnitude", options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)mu, 6));
   for (int j = 0; j < 3; j++) {
      double expected = 4 * pow(sin((n - j) * pi / (2 * (n + 1))), 2);
      CHECK(cabs(mu[j] - expected) < 1e-10);
   }
   CHECK_OK(kschur_result_get_eigenvectors(result, (double *)x, 6 * n));
   for (int i = 0; i < n; i++) {
      norm += creal(x[i] * conj(x[i]));
      CHECK(cabs(2 * x[i] - (i > 0 ? x[i - 1] : 0) - (i < n - 1 ? x[i + 1] : 0) - mu[0] * x[i]) < 1e-9);
   }
   CHECK_NEAR(norm, 1, 1e-12);
   CHECK_OK(kschur_result_get_counts(result, &applications, NULL, NULL));
   CHECK(applications == own.applications);
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CONVERGED);

   CHECK_OK(kschur_options_set_target(options, 2.03, 0));
   CHECK_OK(kschur_options_set_modes(options, 1));
   CHECK_OK(kschur_options_set_subspace(options, 40));
   CHECK_OK(kschur_options_set_tolerance(options, 1e-8));
   CHECK_OK(kschur_solve_real_operator(12, difference, &own, "nearest-target", options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)mu, 2));
   CHECK(cabs(mu[0] - 4 * pow(sin(7 * pi / 26), 2)) < 1e-7);

   /* The rightmost of 3 + i exp(2 pi i j / 8) is 4, at j = 6. */
   CHECK_OK(kschur_solve_complex_operator(8, cycle, &own, "largest-real", options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)mu, 2));
   CHECK(cabs(mu[0] - 4) < 1e-7);
   CHECK_OK(kschur_solve_complex_operator(8, cycle, &own, "smallest-imaginary", options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)mu, 2));
   CHECK(cabs(mu[0] - (3 - I)) < 1e-7);
   CHECK_OK(kschur_solve_complex_operator(8, cycle, &own, "largest-imaginary", options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)mu, 2));
   CHECK(cabs(mu[0] - (3 + I)) < 1e-7);
   CHECK_OK(kschur_solve_complex_operator(8, cycle, &own, "smallest-real", options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)mu, 2));
   CHECK(cabs(mu[0] - 2) < 1e-7);
   CHECK_OK(kschur_solve_complex_operator(8, cycle, &own, "smallest-magnitude", options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)mu, 2));
   CHECK(cabs(mu[0] - 2) < 1e-7);

   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void operators_that_fail(void)
{
   kschur_options *options = new_options(2);
   kschur_result *result = new_result();
   operator_context own = {0, 5};
   watch seen = {0, 1, 0, 0};
   int reason;

   CHECK_STATUS(kschur_solve_real_operator(60, difference, &own, "largest-real", options, result), KSCHUR_ERROR_CALLBACK);
   CHECK_MESSAGE(result, result, "the callback 'apply' returned 42");
   CHECK_STATUS(kschur_result_get_modes(result, NULL, NULL), KSCHUR_ERROR_ORDER);
   own = (operator_context){0, 1};
   CHECK_STATUS(kschur_solve_complex_operator(60, difference, &own, "largest-real", options, result), KSCHUR_ERROR_CALLBACK);
   CHECK_STATUS(kschur_solve_real_operator(60, difference, &own, "best", options, result), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "there is no criterion 'best'");
   CHECK_STATUS(kschur_solve_real_operator(0, difference, &own, "largest-real", options, result), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_solve_real_operator(-3, difference, &own, "largest-real", options, result), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_solve_real_operator(INT64_MAX, difference, &own, "largest-real", options, result),
                KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_solve_real_operator(1, difference, &own, "largest-real", options, result), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "2 eigenvalues were asked for");

   own.fail_at = -1;
   CHECK_OK(kschur_options_set_progress(options, progress, &seen));
   CHECK_OK(kschur_solve_real_operator(60, difference, &own, "largest-real", options, result));
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CANCELLED);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

/* ---- Linear solvers: dense elimination with pivots ---- */

typedef struct {
   int factorizations, releases, adjoints, alive, fail_factorize_at, fail_solve, always_singular;
} solver_context;

typedef struct {
   int64_t n;
   double complex *a;
   int64_t *pivot;
} lu;

static int eliminate(solver_context *own, int64_t n, const int32_t *row_start, const int32_t *column, const double *value,
                     int is_complex, void **factors)
{
   lu *f;

   CHECK(*factors == NULL);
   if (own->always_singular) return KSCHUR_ERROR_SINGULAR;
   if (own->factorizations + 1 == own->fail_factorize_at) return 17;
   f = malloc(sizeof *f);
   f->n = n;
   f->a = calloc(n * n, sizeof *f->a);
   f->pivot = malloc(n * sizeof *f->pivot);
   for (int64_t i = 0; i < n; i++)
      for (int64_t k = row_start[i]; k < row_start[i + 1]; k++) {
         CHECK(k == row_start[i] || column[k] > column[k - 1]);
         f->a[i * n + column[k]] = is_complex ? value[2 * k] + value[2 * k + 1] * I : value[k];
      }
   for (int64_t j = 0; j < n; j++) {
      int64_t p = j;
      for (int64_t i = j + 1; i < n; i++)
         if (cabs(f->a[i * n + j]) > cabs(f->a[p * n + j])) p = i;
      f->pivot[j] = p;
      if (f->a[p * n + j] == 0) {
         free(f->a);
         free(f->pivot);
         free(f);
         return KSCHUR_ERROR_SINGULAR;
      }
      for (int64_t k = 0; k < n && p != j; k++) {
         double complex swapped = f->a[j * n + k];
         f->a[j * n + k] = f->a[p * n + k];
         f->a[p * n + k] = swapped;
      }
      for (int64_t i = j + 1; i < n; i++) {
         f->a[i * n + j] /= f->a[j * n + j];
         for (int64_t k = j + 1; k < n; k++) f->a[i * n + k] -= f->a[i * n + j] * f->a[j * n + k];
      }
   }
   own->factorizations++;
   own->alive++;
   *factors = f;
   return 0;
}

static int factorize_real(void *context, int64_t n, int64_t entries, const int32_t *row_start, const int32_t *column,
                          const double *value, int symmetric, void **factors)
{
   CHECK(row_start[0] == 0 && row_start[n] == entries && (symmetric == 0 || symmetric == 1));
   return eliminate(context, n, row_start, column, value, 0, factors);
}

static int factorize_complex(void *context, int64_t n, int64_t entries, const int32_t *row_start, const int32_t *column,
                             const double *value, int symmetric, void **factors)
{
   CHECK(row_start[0] == 0 && row_start[n] == entries && (symmetric == 0 || symmetric == 1));
   return eliminate(context, n, row_start, column, value, 1, factors);
}

static void exchange(double complex *x, int64_t i, int64_t j)
{
   double complex swapped = x[i];

   x[i] = x[j];
   x[j] = swapped;
}

/* x := A^-1 x with P A = L U, or A^-H x. */
static void substitute(const lu *f, int adjoint, double complex *x)
{
   int64_t n = f->n;

   if (!adjoint) {
      for (int64_t i = 0; i < n; i++) exchange(x, i, f->pivot[i]);
      for (int64_t i = 0; i < n; i++)
         for (int64_t k = 0; k < i; k++) x[i] -= f->a[i * n + k] * x[k];
      for (int64_t i = n - 1; i >= 0; i--) {
         for (int64_t k = i + 1; k < n; k++) x[i] -= f->a[i * n + k] * x[k];
         x[i] /= f->a[i * n + i];
      }
   } else {
      for (int64_t i = 0; i < n; i++) {
         for (int64_t k = 0; k < i; k++) x[i] -= conj(f->a[k * n + i]) * x[k];
         x[i] /= conj(f->a[i * n + i]);
      }
      for (int64_t i = n - 1; i >= 0; i--)
         for (int64_t k = i + 1; k < n; k++) x[i] -= conj(f->a[k * n + i]) * x[k];
      for (int64_t i = n - 1; i >= 0; i--) exchange(x, i, f->pivot[i]);
   }
}

static int solve_real(void *context, void *factors, int adjoint, int64_t n, int64_t vectors, double *x)
{
   solver_context *own = context;
   double complex *column = malloc(n * sizeof *column);

   CHECK(((lu *)factors)->n == n);
   own->adjoints += adjoint;
   for (int64_t j = 0; j < vectors; j++, x += n) {
      for (int64_t i = 0; i < n; i++) column[i] = x[i];
      substitute(factors, adjoint, column);
      for (int64_t i = 0; i < n; i++) x[i] = creal(column[i]);
   }
   free(column);
   return own->fail_solve;
}

static int solve_complex(void *context, void *factors, int adjoint, int64_t n, int64_t vectors, double *x)
{
   solver_context *own = context;

   CHECK(((lu *)factors)->n == n);
   own->adjoints += adjoint;
   for (int64_t j = 0; j < vectors; j++) substitute(factors, adjoint, (double complex *)x + j * n);
   return own->fail_solve;
}

static void release(void *context, void *factors)
{
   solver_context *own = context;
   lu *f = factors;

   own->releases++;
   own->alive--;
   free(f->a);
   free(f->pivot);
   free(f);
}

/* A constrained, damped, unsymmetric problem by the library's solver and by this one. */
static void own_solvers_give_the_same_modes(void)
{
   enum { n = 10, modes = 4 };
   kschur_problem *problem = new_chain_with_dashpot(n, 3);
   kschur_options *options = new_options(modes);
   kschur_result *result = new_result();
   solver_context real = {0}, complex_ = {0};
   double complex expected[modes], lambda[modes];
   double expected_condition[modes], condition[modes];
   char text[100];
   int certified;

   set_tridiagonal(problem, KSCHUR_STIFFNESS, n, 200, -90, -100);
   tie(problem, n, 1, (const int[]){3}, (const int[]){7});
   CHECK_OK(kschur_options_set_left(options, 1));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)expected, 2 * modes));
   CHECK_OK(kschur_result_get_condition_numbers(result, expected_condition, modes));

   CHECK_OK(kschur_options_set_real_solver(options, factorize_real, solve_real, release, &real));
   CHECK_OK(kschur_options_set_complex_solver(options, factorize_complex, solve_complex, release, &complex_));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)lambda, 2 * modes));
   CHECK_OK(kschur_result_get_condition_numbers(result, condition, modes));
   for (int j = 0; j < modes; j++) {
      CHECK(cabs(lambda[j] - expected[j]) < 1e-10);
      CHECK_NEAR(condition[j], expected_condition[j], 1e-8 * expected_condition[j]);
   }
   CHECK(real.factorizations > 0 && real.adjoints > 0 && real.alive == 0 && real.releases == real.factorizations);
   CHECK_OK(kschur_result_get_inner(result, text, sizeof text));
   CHECK(strcmp(text, "callbacks: the matrix is real") == 0);
   CHECK_OK(kschur_result_get_certified(result, &certified));
   CHECK(certified == KSCHUR_CERTIFIED_UNKNOWN);

   CHECK_OK(kschur_options_set_shift(options, -0.3, 4));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)lambda, 2 * modes));
   for (int j = 0; j < modes; j++) CHECK(cabs(lambda[j] - expected[j]) < 1e-9);
   CHECK(complex_.factorizations > 0 && complex_.adjoints > 0 && complex_.alive == 0);
   CHECK_OK(kschur_result_get_inner(result, text, sizeof text));
   CHECK(strcmp(text, "callbacks: the matrix is complex") == 0);

   /* A solver of one's own excludes the choice among the library's. */
   CHECK_OK(kschur_options_set_inner(options, "mumps"));
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_USAGE);
   real.factorizations = 0;
   CHECK_OK(kschur_options_set_real_solver(options, NULL, NULL, NULL, NULL));
   CHECK_OK(kschur_options_set_complex_solver(options, NULL, NULL, NULL, NULL));
   CHECK_OK(kschur_options_clear_shift(options));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK(real.factorizations == 0);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void solvers_that_fail(void)
{
   kschur_problem *problem = new_chain_with_dashpot(10, 3);
   kschur_options *options = new_options(3);
   kschur_result *result = new_result();
   solver_context own = {0};

   CHECK_OK(kschur_options_set_real_solver(options, factorize_real, solve_real, release, &own));
   for (int at = 1; at <= 2; at++) {
      own.factorizations = 0;
      own.fail_factorize_at = at;
      CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_CALLBACK);
      CHECK_MESSAGE(result, result, "the callback 'factorize' returned 17");
      CHECK(own.alive == 0);
   }
   own.fail_factorize_at = 0;
   own.fail_solve = 5;
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_CALLBACK);
   CHECK_MESSAGE(result, result, "the callback 'solve' returned 5");
   CHECK(own.alive == 0);
   own.fail_solve = 0;
   own.always_singular = 1;
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_SINGULAR);
   CHECK(own.alive == 0);
   own.always_singular = 0;
   CHECK_OK(kschur_solve_band(problem, 0.5, 1, options, result));
   CHECK(own.alive == 0);

   /* Without a release the factors are the caller's to free. */
   CHECK_OK(kschur_options_set_real_solver(options, factorize_real, solve_real, NULL, &own));
   own.always_singular = 1;
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_SINGULAR);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

int main(void)
{
   a_progress_report_can_cancel();
   a_stop_is_asked_in_every_phase();
   a_callback_may_solve();
   operators_without_a_matrix();
   operators_that_fail();
   own_solvers_give_the_same_modes();
   solvers_that_fail();
   return report_checks();
}
