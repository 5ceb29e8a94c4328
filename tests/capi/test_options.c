/* Every option: its effect, and what it refuses. */
#include "models.h"

static char text[1000];

static void refused(void)
{
   kschur_options *options = new_options(3);

   CHECK_STATUS(kschur_options_set_modes(options, 0), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "the number of modes is 0 but must be at least 1");
   CHECK_STATUS(kschur_options_set_modes(options, 5000000000), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "the number of modes is 5000000000");
   CHECK_STATUS(kschur_options_set_modes(options, INT64_MIN), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_modes(options, INT32_MAX), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "the number of modes is 2147483647 but must be at most 10000000");
   CHECK_STATUS(kschur_options_set_subspace(options, INT32_MAX), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_block(options, INT32_MAX), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_threads(options, INT32_MAX), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_target(options, NAN, 0), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_target(options, 0, INFINITY), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_target_hz(options, 1e200), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_target_hz(options, -1), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "the frequency must not be negative");
   CHECK_STATUS(kschur_options_set_shift(options, NAN, NAN), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "the shift must be a number");
   CHECK_STATUS(kschur_options_set_formulation(options, "cubic"), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "there is no formulation 'cubic', only auto, undamped,");
   CHECK_STATUS(kschur_options_set_method(options, "lanczos"), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "there is no method 'lanczos', only krylov-schur, arpack");
   CHECK_STATUS(kschur_options_set_arpack(options, "good"), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_constraint_scaling(options, "column"), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "only none, scalar, row");
   CHECK_STATUS(kschur_options_set_inner(options, ""), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_subspace(options, -1), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_block(options, -1), KSCHUR_ERROR_USAGE);
   CHECK_OK(kschur_options_set_block(options, 3));
   CHECK_STATUS(kschur_options_set_threads(options, -1), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "the number of threads is -1 but must be at least 0");
   CHECK_OK(kschur_options_set_threads(options, 2));
   CHECK_STATUS(kschur_options_set_distribute(options, 0), KSCHUR_ERROR_USAGE);
   CHECK_OK(kschur_options_set_distribute(options, 100));
   CHECK_STATUS(kschur_options_set_groups(options, -1), KSCHUR_ERROR_USAGE);
   CHECK_OK(kschur_options_set_groups(options, 2));
   CHECK_STATUS(kschur_options_set_tolerance(options, 0), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_tolerance(options, NAN), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_max_restarts(options, 0), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_seed(options, 5000000000), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set_seed(options, INT64_MIN), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "the seed is -9223372036854775808");
   kschur_options_destroy(&options);
}

static void modes_target_and_shift(void)
{
   kschur_problem *problem = new_chain(30, 0, 0);
   kschur_options *options = NULL;
   kschur_result *result = new_result();
   double frequency[10], re, im;
   int64_t found, asked;
   int certified;

   /* By default the ten lowest. */
   CHECK_OK(kschur_options_create(&options));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_modes(result, &found, &asked));
   CHECK(found == 10 && asked == 10);
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 10));
   for (int j = 0; j < 10; j++) CHECK_NEAR(frequency[j], chain_omega(30, j + 1) / (2 * pi), 1e-13);
   CHECK_OK(kschur_result_get_certified(result, &certified));
   CHECK(certified == KSCHUR_CERTIFIED_YES);

   CHECK_OK(kschur_options_set_modes(options, 2));
   CHECK_OK(kschur_options_set_target_hz(options, chain_omega(30, 15) / (2 * pi) * 1.0001));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_modes(result, &found, NULL));
   CHECK(found == 2);
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 10));
   CHECK_NEAR(frequency[0], chain_omega(30, 15) / (2 * pi), 1e-12);
   CHECK_OK(kschur_result_get_target(result, &re, &im));
   CHECK(re == 0);
   CHECK_NEAR(im, chain_omega(30, 15) * 1.0001, 1e-12);

   CHECK_OK(kschur_options_set_target(options, -0.5, 20));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 10));
   CHECK_NEAR(frequency[0], chain_omega(30, 30) / (2 * pi), 1e-12);
   CHECK_OK(kschur_result_get_target(result, &re, &im));
   CHECK(re == -0.5 && im == 20);

   CHECK_OK(kschur_options_set_shift(options, 0.25, 3));
   CHECK_OK(kschur_options_set_formulation(options, "quadratic"));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_shift(result, &re, &im));
   CHECK(re == 0.25 && im == 3);
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 10));
   CHECK_NEAR(frequency[0], chain_omega(30, 30) / (2 * pi), 1e-11);
   CHECK_OK(kschur_options_clear_shift(options));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_shift(result, &re, &im));
   CHECK(re != 0.25);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void names(void)
{
   static const char *const formulations[] = {"symmetric", "quadratic", "undamped", "undamped-negative"};
   kschur_problem *problem = new_chain(8, 0, 0);
   kschur_options *options = new_options(2);
   kschur_result *result = new_result();
   double frequency[2];

   for (int i = 0; i < 4; i++) {
      CHECK_OK(kschur_options_set_formulation(options, formulations[i]));
      CHECK_OK(kschur_solve(problem, options, result));
      CHECK_OK(kschur_result_get_formulation(result, text, sizeof text));
      CHECK(strcmp(text, formulations[i]) == 0);
      CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 2));
      CHECK_NEAR(frequency[1], chain_omega(8, 2) / (2 * pi), 1e-12);
   }
   CHECK_OK(kschur_options_set_formulation(options, "auto"));
   CHECK_OK(kschur_solve(problem, options, result));

   for (int i = 0; i < 2; i++) {
      CHECK_OK(kschur_options_set_method(options, "arpack"));
      CHECK_OK(kschur_options_set_arpack(options, i == 0 ? "fair" : "plain"));
      CHECK_OK(kschur_solve(problem, options, result));
      CHECK_OK(kschur_result_get_method(result, text, sizeof text));
      CHECK(strcmp(text, i == 0 ? "arpack-fair" : "arpack-plain") == 0);
      CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 2));
      CHECK_NEAR(frequency[1], chain_omega(8, 2) / (2 * pi), 1e-10);
   }
   CHECK_STATUS(kschur_options_set_left(options, 1), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "plain ARPACK gives no left vectors");
   CHECK_OK(kschur_options_set_method(options, "krylov-schur"));

   CHECK_OK(kschur_options_set_inner(options, "mumps"));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_inner(result, text, sizeof text));
   CHECK(strncmp(text, "mumps", 5) == 0);
   CHECK_OK(kschur_options_set_inner(options, "iterative"));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 2));
   CHECK_NEAR(frequency[1], chain_omega(8, 2) / (2 * pi), 1e-11);
   CHECK_OK(kschur_options_set_inner(options, "ldl"));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_inner(result, text, sizeof text));
   CHECK(strncmp(text, "ldl", 3) == 0);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

/* The masses at both ends of the chain tied: an antisymmetric mode has them apart, so that only symmetric modes stay
 * as they were. */
static void constraints_and_presolve(void)
{
   static const char *const scalings[] = {"row", "scalar", "none"};
   kschur_problem *problem = new_chain(9, 0, 0);
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();
   double frequency;
   int64_t order_without, order_with;

   tie(problem, 9, 1, (const int[]){0}, (const int[]){8});
   for (int i = 0; i < 3; i++) {
      CHECK_OK(kschur_options_set_constraint_scaling(options, scalings[i]));
      CHECK_OK(kschur_options_set_presolve(options, 0));
      CHECK_OK(kschur_solve(problem, options, result));
      CHECK_OK(kschur_result_get_frequencies_hz(result, &frequency, 1));
      CHECK_NEAR(frequency, chain_omega(9, 1) / (2 * pi), 1e-13);
      CHECK_OK(kschur_result_get_factors(result, &order_without, NULL));
      CHECK(order_without == 10);
   }
   CHECK_OK(kschur_options_set_presolve(options, 7));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, &frequency, 1));
   CHECK_NEAR(frequency, chain_omega(9, 1) / (2 * pi), 1e-13);
   CHECK_OK(kschur_result_get_factors(result, &order_with, NULL));
   CHECK(order_with == 8);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void iteration(void)
{
   kschur_problem *problem = new_chain_with_dashpot(60, 5);
   kschur_options *options = new_options(5);
   kschur_result *result = new_result();
   int64_t applications, more, restarts;
   double first[10], second[10], shapes[600], other_shapes[600];
   int reason;

   CHECK_OK(kschur_options_set_subspace(options, 16));
   CHECK_OK(kschur_options_set_max_restarts(options, 1));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_MAX_RESTARTS);
   CHECK_OK(kschur_options_set_max_restarts(options, 100));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CONVERGED);
   CHECK_OK(kschur_result_get_counts(result, &applications, &restarts, NULL));
   CHECK(restarts > 0);
   CHECK_OK(kschur_result_get_eigenvalues(result, first, 10));

   CHECK_OK(kschur_options_set_tolerance(options, 1e-4));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_counts(result, &more, NULL, NULL));
   CHECK(more < applications);

   /* The same seed gives the same digits, another one others. */
   CHECK_OK(kschur_options_set_tolerance(options, 1e-12));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, second, 10));
   CHECK(memcmp(first, second, sizeof first) == 0);
   CHECK_OK(kschur_result_get_eigenvectors(result, shapes, 600));
   CHECK_OK(kschur_options_set_seed(options, 2));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, second, 10));
   CHECK_OK(kschur_result_get_eigenvectors(result, other_shapes, 600));
   CHECK(memcmp(shapes, other_shapes, sizeof shapes) != 0);
   for (int j = 0; j < 10; j++) CHECK_NEAR(first[j], second[j], 1e-10);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void checkpoints(void)
{
   kschur_problem *problem = new_chain_with_dashpot(60, 5);
   kschur_options *options = new_options(5);
   kschur_result *result = new_result();
   double first[10], second[10];
   FILE *file;

   CHECK_STATUS(kschur_options_set_checkpoint(options, NULL), KSCHUR_ERROR_NULL);
   CHECK_OK(kschur_options_set(options, "subspace", "16"));
   CHECK_OK(kschur_options_set(options, "checkpoint", "kschur_options.checkpoint"));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, first, 10));
   CHECK_OK(kschur_options_set(options, "checkpoint", ""));
   CHECK_OK(kschur_options_set(options, "resume", "kschur_options.checkpoint"));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, second, 10));
   CHECK(memcmp(first, second, sizeof first) == 0);
   CHECK_OK(kschur_options_set_modes(options, 4));
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(result, result, "kschur_options.checkpoint: the checkpoint of a solve with other options");
   file = fopen("kschur_options.checkpoint", "w");
   CHECK(file != NULL && fclose(file) == 0);
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(result, result, "kschur_options.checkpoint: not a checkpoint, or a damaged one");
   CHECK(remove("kschur_options.checkpoint") == 0);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void options_that_do_not_fit_the_problem(void)
{
   kschur_problem *problem = new_chain(5, 0.1, 0);
   kschur_options *options = new_options(2);
   kschur_result *result = new_result();

   CHECK_OK(kschur_options_set_formulation(options, "undamped"));
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "undamped");
   CHECK_STATUS(kschur_result_get_modes(result, NULL, NULL), KSCHUR_ERROR_ORDER);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

int main(void)
{
   refused();
   modes_target_and_shift();
   names();
   constraints_and_presolve();
   iteration();
   checkpoints();
   options_that_do_not_fit_the_problem();
   return report_checks();
}
