/* A solver that remembers: the closed forms of chains, as their springs become stiffer and targets move. */
#include <complex.h>

#include "models.h"

enum { n = 300, modes = 4 };

static void other_values_and_targets(void)
{
   kschur_problem *problem = new_chain(n, 0.01, 0), *other = new_chain(4, 0, 0);
   kschur_options *options = new_options(modes);
   kschur_result *result = new_result();
   kschur_solver *solver = NULL;
   double frequency[n];
   int64_t first, again, found;

   CHECK_STATUS(kschur_solver_create(NULL), KSCHUR_ERROR_NULL);
   CHECK_OK(kschur_solver_create(&solver));
   CHECK_STATUS(kschur_solver_solve(solver, options, result), KSCHUR_ERROR_ORDER);
   CHECK_MESSAGE(result, result, "kschur_solver_set_problem");
   CHECK_STATUS(kschur_solver_set_problem(solver, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solver_set_problem(NULL, problem), KSCHUR_ERROR_NULL);
   CHECK_OK(kschur_solver_set_problem(solver, problem));
   CHECK_STATUS(kschur_solver_solve(NULL, options, result), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solver_solve(solver, options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solver_solve(solver, NULL, result), KSCHUR_ERROR_NULL);
   for (int i = 0; i < 4; i++) {
      double stiffer = 1 + 0.1 * i;
      if (i > 0) {
         set_tridiagonal(problem, KSCHUR_STIFFNESS, n, 200 * stiffer, -100 * stiffer, -100 * stiffer);
         CHECK_OK(kschur_solver_set_problem(solver, problem));
      }
      CHECK_OK(kschur_solver_solve(solver, options, result));
      CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, modes));
      for (int j = 0; j < modes; j++)
         CHECK_NEAR(frequency[j], sqrt(stiffer) * chain_omega(n, j + 1) / (2 * pi), 1e-11);
      CHECK_OK(kschur_result_get_counts(result, NULL, NULL, i == 0 ? &first : &again));
      /* For the motions and the iteration; the mass is never factored. */
      CHECK((i == 0 ? first : again) == 2);
   }
   CHECK_OK(kschur_options_set_target_hz(options, 1.5));
   CHECK_OK(kschur_solver_solve(solver, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, modes));
   for (int j = 0; j < modes; j++) CHECK(fabs(frequency[j] - 1.5) < 0.1);
   CHECK_OK(kschur_solver_solve_band(solver, 0, 0.1, options, result));
   CHECK_OK(kschur_result_get_modes(result, &found, NULL));
   CHECK(found >= 5 && found <= n);
   CHECK_STATUS(kschur_solver_solve_band(solver, 2, 1, options, result), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_solver_set_problem(solver, other), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(solver, solver, "other numbers of unknowns");
   CHECK_OK(kschur_solver_destroy(&solver));
   CHECK(solver == NULL);
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&other);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

/* The eigenvalues nearest to each target, one of them asked for twice, against the closed form. */
static void several_targets(void)
{
   enum { count = 4 };
   kschur_problem *problem = new_chain(n, 0.01, 0);
   kschur_options *options = new_options(modes);
   kschur_solver *solver = NULL;
   kschur_result *results[count], *none[1] = {NULL};
   const double targets[2 * count] = {0, 1, 0, 1.4, 0, 9, 0, 1};

   for (int i = 0; i < count; i++) results[i] = new_result();
   CHECK_OK(kschur_solver_create(&solver));
   CHECK_STATUS(kschur_solver_solve_targets(NULL, count, targets, options, results), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solver_solve_targets(solver, count, targets, options, results), KSCHUR_ERROR_ORDER);
   CHECK_OK(kschur_solver_set_problem(solver, problem));
   CHECK_STATUS(kschur_solver_solve_targets(solver, count, NULL, options, results), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solver_solve_targets(solver, count, targets, options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solver_solve_targets(solver, 1, targets, options, none), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(solver, solver, "results[0]");
   CHECK_STATUS(kschur_solver_solve_targets(solver, 0, targets, options, results), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_solver_solve_targets(solver, (int64_t)1 << 31, targets, options, results), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(solver, solver, "between 1 and 2147483647, not be 2147483648");
   CHECK_OK(kschur_solver_solve_targets(solver, count, targets, options, results));
   for (int i = 0; i < count; i++) {
      double frequency[modes], wanted = targets[2 * i + 1], furthest = 0;
      int closer = 0;
      CHECK_OK(kschur_result_get_frequencies_hz(results[i], frequency, modes));
      for (int j = 0; j < modes; j++) {
         double nearest = HUGE_VAL;
         for (int k = 1; k <= n; k++) nearest = fmin(nearest, fabs(2 * pi * frequency[j] - chain_omega(n, k)));
         CHECK_NEAR(nearest, 0, 1e-9);
         furthest = fmax(furthest, fabs(2 * pi * frequency[j] - wanted));
      }
      for (int k = 1; k <= n; k++) closer += fabs(chain_omega(n, k) - wanted) < furthest - 1e-6;
      CHECK(closer == modes - 1);
   }
   for (int i = 0; i < count; i++) kschur_result_destroy(&results[i]);
   CHECK_OK(kschur_solver_destroy(&solver));
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
}

/* All modes of a chain in two bands that touch, against the closed form; proved. */
static void several_bands(void)
{
   enum { count = 2 };
   kschur_problem *problem = new_chain(n, 0, 0);
   kschur_options *options = new_options(modes);
   kschur_solver *solver = NULL;
   kschur_result *results[count];
   const double edges[2 * count] = {0, 1, 1, 4}, none[2] = {2, 1};
   int k = 0;

   for (int i = 0; i < count; i++) results[i] = new_result();
   CHECK_OK(kschur_solver_create(&solver));
   CHECK_OK(kschur_solver_set_problem(solver, problem));
   CHECK_STATUS(kschur_solver_solve_bands(solver, count, NULL, options, results), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solver_solve_bands(solver, 1, none, options, results), KSCHUR_ERROR_USAGE);
   CHECK_OK(kschur_solver_solve_bands(solver, count, edges, options, results));
   for (int i = 0; i < count; i++) {
      double frequency[n];
      int64_t found = 0;
      int certified = -1;
      CHECK_OK(kschur_result_get_modes(results[i], &found, NULL));
      CHECK_OK(kschur_result_get_certified(results[i], &certified));
      CHECK(certified == KSCHUR_CERTIFIED_YES);
      CHECK_OK(kschur_result_get_frequencies_hz(results[i], frequency, found));
      for (int j = 0; j < found; j++) CHECK_NEAR(2 * pi * frequency[j], chain_omega(n, ++k), 1e-9);
   }
   CHECK(k == n);
   for (int i = 0; i < count; i++) kschur_result_destroy(&results[i]);
   CHECK_OK(kschur_solver_destroy(&solver));
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
}

int main(void)
{
   several_targets();
   several_bands();
   other_values_and_targets();
   return report_checks();
}
