/* Null handles, null arguments and calls in the wrong order: each a status and, where there is a handle, a message. */
#include "models.h"

static int apply(void *context, int64_t n, int64_t vectors, const double *x, double *y)
{
   (void)context;
   for (int64_t i = 0; i < n * vectors; i++) y[i] = (double)(i % n + 1) * x[i];
   return 0;
}

static int factorize(void *context, int64_t n, int64_t entries, const int32_t *row_start, const int32_t *column,
                     const double *value, int symmetric, void **factors)
{
   (void)context, (void)n, (void)entries, (void)row_start, (void)column, (void)value, (void)symmetric, (void)factors;
   return 1;
}

static int substitute(void *context, void *factors, int adjoint, int64_t n, int64_t vectors, double *x)
{
   (void)context, (void)factors, (void)adjoint, (void)n, (void)vectors, (void)x;
   return 1;
}

/* Every function of a result but those that make it and read its message, with arguments that are right. */
static void call_getters(kschur_result *result, int expected, int expected_of_operator)
{
   double d[3000];
   int64_t k;
   int i[100];
   char text[300];

   CHECK_STATUS(kschur_result_get_modes(result, &k, &k), expected_of_operator);
   CHECK_STATUS(kschur_result_get_eigenvalues(result, d, 3000), expected_of_operator);
   CHECK_STATUS(kschur_result_get_eigenvectors(result, d, 3000), expected_of_operator);
   CHECK_STATUS(kschur_result_get_reason(result, i), expected_of_operator);
   CHECK_STATUS(kschur_result_get_counts(result, &k, &k, &k), expected_of_operator);
   CHECK_STATUS(kschur_result_get_seconds(result, d, d, d, d, d), expected_of_operator);
   CHECK_STATUS(kschur_result_get_history_count(result, &k), expected_of_operator);
   CHECK_STATUS(kschur_result_get_history(result, NULL, NULL, d, 3000), expected_of_operator);
   CHECK_STATUS(kschur_result_get_size(result, &k, &k), expected);
   CHECK_STATUS(kschur_result_get_multipliers(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_frequencies_hz(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_damped_frequencies_hz(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_damping_ratios(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_backward_errors(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_errors(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_kinds(result, i, 100), expected);
   CHECK_STATUS(kschur_result_get_left_eigenvectors(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_left_multipliers(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_condition_numbers(result, d, 3000), expected);
   CHECK_STATUS(kschur_result_get_certified(result, i), expected);
   CHECK_STATUS(kschur_result_get_missing(result, &k), expected);
   CHECK_STATUS(kschur_result_get_note_count(result, &k), expected);
   CHECK_STATUS(kschur_result_get_note(result, 0, text, 300), expected == KSCHUR_OK ? KSCHUR_ERROR_USAGE : expected);
   CHECK_STATUS(kschur_result_get_method(result, text, 300), expected);
   CHECK_STATUS(kschur_result_get_formulation(result, text, 300), expected);
   CHECK_STATUS(kschur_result_get_decision(result, text, 300), expected);
   CHECK_STATUS(kschur_result_get_inner(result, text, 300), expected);
   CHECK_STATUS(kschur_result_get_target(result, d, d), expected);
   CHECK_STATUS(kschur_result_get_shift(result, d, d), expected);
   CHECK_STATUS(kschur_result_get_factors(result, &k, &k), expected);
   CHECK_STATUS(kschur_result_get_redundant_constraints(result, &k), expected);
   if (expected != KSCHUR_OK) CHECK_STATUS(kschur_result_write_hdf5(result, "nothing.h5"), expected);
}

static void null_handles(void)
{
   const int32_t index[2] = {0, 1};
   const int64_t wide[2] = {0, 1};
   const double one = 1;
   char text[100];
   int64_t k;

   CHECK_STATUS(kschur_problem_create(NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_destroy(NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_get_message(NULL, text, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_csr(NULL, 0, 1, 1, 1, 0, index, index, &one), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_csr64(NULL, 0, 1, 1, 1, 0, wide, wide, &one), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_triplets(NULL, 0, 1, 1, 1, 0, index, index, &one), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_triplets64(NULL, 0, 1, 1, 1, 0, wide, wide, &one), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_symmetric(NULL, "lower"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_get_size(NULL, &k, &k), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_read_hdf5(NULL, "nothing.h5"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_write_hdf5(NULL, "nothing.h5"), KSCHUR_ERROR_NULL);

   CHECK_STATUS(kschur_options_create(NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_destroy(NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_get_message(NULL, text, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_modes(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_target(NULL, 1, 0), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_target_hz(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_shift(NULL, 1, 0), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_clear_shift(NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_method(NULL, "arpack"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_arpack(NULL, "fair"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_formulation(NULL, "auto"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_constraint_scaling(NULL, "row"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_inner(NULL, "auto"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_subspace(NULL, 20), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_block(NULL, 2), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_threads(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_communicator(NULL, 0), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_distribute(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_groups(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_memory(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_tolerance(NULL, 1e-9), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_max_restarts(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_presolve(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_left(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_certify(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_seed(NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_checkpoint(NULL, "file"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_resume(NULL, "file"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_normalisation(NULL, "mass"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_progress(NULL, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_stop(NULL, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_real_solver(NULL, factorize, substitute, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_complex_solver(NULL, factorize, substitute, NULL, NULL), KSCHUR_ERROR_NULL);

   CHECK_STATUS(kschur_result_create(NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_destroy(NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_message(NULL, text, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_read_hdf5(NULL, "nothing.h5"), KSCHUR_ERROR_NULL);
   call_getters(NULL, KSCHUR_ERROR_NULL, KSCHUR_ERROR_NULL);
}

static void null_handles_of_solves(void)
{
   kschur_problem *problem = new_chain(4, 0, 0);
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();

   CHECK_STATUS(kschur_solve(problem, options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solve_band(problem, 0, 1, options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solve_real_operator(4, apply, NULL, "largest-real", options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solve_complex_operator(4, apply, NULL, "largest-real", options, NULL), KSCHUR_ERROR_NULL);

   CHECK_STATUS(kschur_solve(NULL, options, result), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'problem' is null");
   CHECK_STATUS(kschur_solve(problem, NULL, result), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'options' is null");
   CHECK_STATUS(kschur_solve_band(NULL, 0, 1, options, result), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solve_band(problem, 0, 1, NULL, result), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_solve_real_operator(4, NULL, NULL, "largest-real", options, result), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'apply' is null");
   CHECK_STATUS(kschur_solve_real_operator(4, apply, NULL, NULL, options, result), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'which' is null");
   CHECK_STATUS(kschur_solve_complex_operator(4, apply, NULL, "largest-real", NULL, result), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'options' is null");

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void null_arguments(void)
{
   const int32_t index[2] = {0, 1};
   const double one = 1;
   kschur_problem *problem = NULL;
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();

   CHECK_OK(kschur_problem_create(&problem));
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 1, 1, 1, 0, NULL, index, &one), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(problem, problem, "the mass matrix M: the argument 'row_start' is null");
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 1, 1, 1, 0, index, NULL, &one), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(problem, problem, "'column' is null");
   CHECK_STATUS(kschur_problem_set_triplets(problem, KSCHUR_MASS, 1, 1, 1, 0, NULL, index, &one), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(problem, problem, "'row' is null");
   CHECK_STATUS(kschur_problem_set_triplets(problem, KSCHUR_MASS, 1, 1, 1, 0, index, index, NULL), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(problem, problem, "'value' is null");
   CHECK_STATUS(kschur_problem_set_triplets64(problem, KSCHUR_MASS, 1, 1, 1, 0, NULL, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_csr64(problem, KSCHUR_MASS, 1, 1, 1, 0, NULL, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_read_hdf5(problem, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_write_hdf5(problem, NULL), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(problem, problem, "'path' is null");
   CHECK_STATUS(kschur_problem_get_message(problem, NULL, 10), KSCHUR_ERROR_NULL);
   /* A matrix without entries needs no arrays of them. */
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 1, 1, 0, 0, NULL, NULL, NULL));

   CHECK_STATUS(kschur_options_set_method(options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_arpack(options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_formulation(options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_constraint_scaling(options, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_inner(options, NULL), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(options, options, "'name' is null");
   CHECK_STATUS(kschur_options_get_message(options, NULL, 10), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_real_solver(options, factorize, NULL, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set_complex_solver(options, NULL, substitute, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(options, options, "needs both");

   CHECK_STATUS(kschur_result_read_hdf5(result, NULL), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'path' is null");
   CHECK_STATUS(kschur_result_get_message(result, NULL, 10), KSCHUR_ERROR_NULL);

   CHECK_STATUS(kschur_status_text(0, NULL, 10), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_kind_name(0, NULL, 10), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_reason_name(0, NULL, 10), KSCHUR_ERROR_NULL);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void null_places_for_results(void)
{
   kschur_problem *problem = new_chain(4, 0, 0);
   kschur_options *options = new_options(2);
   kschur_result *result = new_result();

   CHECK_OK(kschur_options_set_left(options, 1));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_STATUS(kschur_result_get_eigenvalues(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'values' is null");
   CHECK_STATUS(kschur_result_get_eigenvectors(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_frequencies_hz(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_damped_frequencies_hz(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_damping_ratios(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_backward_errors(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_errors(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_kinds(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_left_eigenvectors(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_condition_numbers(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_reason(result, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_certified(result, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_missing(result, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_note_count(result, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_method(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_formulation(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_decision(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_inner(result, NULL, 100), KSCHUR_ERROR_NULL);
   CHECK_MESSAGE(result, result, "'text' is null");
   CHECK_STATUS(kschur_result_get_redundant_constraints(result, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_history_count(result, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_write_hdf5(result, NULL), KSCHUR_ERROR_NULL);
   /* Optional places, and arrays that have no elements. */
   CHECK_OK(kschur_version(NULL, NULL, NULL));
   CHECK_OK(kschur_problem_get_size(problem, NULL, NULL));
   CHECK_OK(kschur_result_get_modes(result, NULL, NULL));
   CHECK_OK(kschur_result_get_size(result, NULL, NULL));
   CHECK_OK(kschur_result_get_target(result, NULL, NULL));
   CHECK_OK(kschur_result_get_shift(result, NULL, NULL));
   CHECK_OK(kschur_result_get_counts(result, NULL, NULL, NULL));
   CHECK_OK(kschur_result_get_seconds(result, NULL, NULL, NULL, NULL, NULL));
   CHECK_OK(kschur_result_get_factors(result, NULL, NULL));
   CHECK_OK(kschur_result_get_history(result, NULL, NULL, NULL, 1000));
   CHECK_OK(kschur_result_get_multipliers(result, NULL, 0));
   CHECK_OK(kschur_result_get_left_multipliers(result, NULL, 0));

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void wrong_order(void)
{
   const int32_t index = 0;
   const double one = 1;
   kschur_problem *problem = NULL;
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();

   call_getters(result, KSCHUR_ERROR_ORDER, KSCHUR_ERROR_ORDER);
   CHECK_MESSAGE(result, result, "solve or read a file first");

   CHECK_OK(kschur_problem_create(&problem));
   CHECK_MESSAGE(problem, problem, "");
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_ORDER);
   CHECK_MESSAGE(result, result, "needs a mass matrix and a stiffness matrix");
   CHECK_STATUS(kschur_problem_get_size(problem, NULL, NULL), KSCHUR_ERROR_ORDER);
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_MASS, 1, 1, 1, 0, &index, &index, &one));
   CHECK_STATUS(kschur_problem_write_hdf5(problem, "nothing.h5"), KSCHUR_ERROR_ORDER);
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 1, 1, 1, 0, &index, &index, &one));
   CHECK_OK(kschur_solve(problem, options, result));

   /* A result of modes has all but left vectors; one of an operator has eigenvalues; one of a failure has nothing. */
   CHECK_OK(kschur_options_set_left(options, 1));
   CHECK_OK(kschur_solve(problem, options, result));
   call_getters(result, KSCHUR_OK, KSCHUR_OK);
   CHECK_OK(kschur_solve_real_operator(4, apply, NULL, "largest-real", options, result));
   call_getters(result, KSCHUR_ERROR_ORDER, KSCHUR_OK);
   CHECK_STATUS(kschur_solve(NULL, options, result), KSCHUR_ERROR_NULL);
   call_getters(result, KSCHUR_ERROR_ORDER, KSCHUR_ERROR_ORDER);

   /* Destroyed twice is destroyed once. */
   CHECK_OK(kschur_problem_destroy(&problem));
   CHECK(problem == NULL);
   CHECK_OK(kschur_problem_destroy(&problem));
   CHECK_OK(kschur_options_destroy(&options));
   CHECK(options == NULL);
   CHECK_OK(kschur_options_destroy(&options));
   CHECK_OK(kschur_result_destroy(&result));
   CHECK(result == NULL);
   CHECK_OK(kschur_result_destroy(&result));
}

int main(void)
{
   null_handles();
   null_handles_of_solves();
   null_arguments();
   null_places_for_results();
   wrong_order();
   return report_checks();
}
