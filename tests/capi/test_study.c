/* What is made of modes, on chains with closed forms: phi_i = sin(i j pi/(n + 1)). */
#include <complex.h>

#include "models.h"

enum { n = 9 };

static char text[1000];

/* Of unit mass; a direction of ones has 2/(n + 1) cot(j pi/(2 (n + 1)))^2 of its mass in each odd mode j. */
static void properties(void)
{
   kschur_problem *problem = new_chain(n, 0.3, 0), *other = new_chain(4, 0, 0);
   kschur_options *options = new_options(n);
   kschur_result *result = new_result();
   double mass[n], damping[n], stiffness[n], effective[n], total, direction[n], sum = 0;
   double complex lambda[n], a[n], b[n], factor[n];

   for (int i = 0; i < n; i++) direction[i] = 1;
   CHECK_OK(kschur_options_set_normalisation(options, "mass"));
   CHECK_STATUS(kschur_options_set_normalisation(options, "weight"), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "no normalisation 'weight', only length, mass, displacement");
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_STATUS(kschur_result_get_generalised_masses(result, mass, n), KSCHUR_ERROR_ORDER);
   CHECK_MESSAGE(result, result, "kschur_result_find_properties");
   CHECK_STATUS(kschur_result_find_properties(result, other, NULL, 0), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_find_properties(result, problem, NULL, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_find_properties(result, NULL, NULL, 0), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_find_properties(result, problem, direction, -1), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_find_properties(result, problem, direction, (int64_t)1 << 32), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "between 0 and 2147483647, not be 4294967296");
   CHECK_OK(kschur_result_find_properties(result, problem, NULL, 0));
   CHECK_OK(kschur_result_get_generalised_masses(result, mass, n));
   CHECK_OK(kschur_result_get_effective_masses(result, NULL, 0));
   CHECK_OK(kschur_result_find_properties(result, problem, direction, 1));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)lambda, 2 * n));
   CHECK_OK(kschur_result_get_generalised_dampings(result, damping, n));
   CHECK_OK(kschur_result_get_generalised_stiffnesses(result, stiffness, n));
   CHECK_OK(kschur_result_get_modal_a(result, (double *)a, 2 * n));
   CHECK_OK(kschur_result_get_modal_b(result, (double *)b, 2 * n));
   CHECK_OK(kschur_result_get_participation_factors(result, (double *)factor, 2 * n));
   CHECK_OK(kschur_result_get_effective_masses(result, effective, n));
   CHECK_OK(kschur_result_get_total_masses(result, &total, 1));
   CHECK_STATUS(kschur_result_get_effective_masses(result, effective, n - 1), KSCHUR_ERROR_LENGTH);
   CHECK_NEAR(total, n, 1e-13);
   for (int j = 1; j <= n; j++) {
      double cotangent = 1 / tan(j * pi / (2 * (n + 1)));
      double expected = j % 2 ? 2.0 / (n + 1) * cotangent * cotangent : 0;
      CHECK_NEAR(mass[j - 1], 1, 1e-13);
      CHECK_NEAR(damping[j - 1], 0.3, 1e-13);
      CHECK_NEAR(sqrt(stiffness[j - 1]), chain_omega(n, j), 1e-11);
      CHECK(cabs(a[j - 1] - (2 * lambda[j - 1] + 0.3)) < 1e-11);
      CHECK(cabs(b[j - 1] + lambda[j - 1] * a[j - 1]) < 1e-9);
      CHECK_NEAR(effective[j - 1], expected, 1e-11);
      CHECK(fabs(fabs(creal(factor[j - 1])) - sqrt(expected)) < 1e-6);
      sum += effective[j - 1];
   }
   CHECK_NEAR(sum, n, 1e-11);
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&other);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void mac(void)
{
   kschur_problem *problem = new_chain(n, 0, 0), *damped = new_chain(n, 0.1, 0.01), *other = new_chain(4, 0, 0);
   kschur_options *options = new_options(3);
   kschur_result *first = new_result(), *second = new_result();
   double values[6];

   CHECK_OK(kschur_solve(problem, options, first));
   CHECK_STATUS(kschur_result_get_mac(first, second, values, 6), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_get_mac(second, first, values, 6), KSCHUR_ERROR_ORDER);
   CHECK_STATUS(kschur_result_get_mac(first, NULL, values, 6), KSCHUR_ERROR_NULL);
   CHECK_OK(kschur_options_set_modes(options, 2));
   CHECK_OK(kschur_solve(damped, options, second));
   CHECK_OK(kschur_result_get_mac(first, second, values, 6));
   for (int i = 0; i < 6; i++) CHECK_NEAR(values[i], i == 0 || i == 4, 1e-12);
   CHECK_OK(kschur_solve(other, options, second));
   CHECK_STATUS(kschur_result_get_mac(first, second, values, 6), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, first, "9 and 4 unknowns");
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&damped);
   kschur_problem_destroy(&other);
   kschur_options_destroy(&options);
   kschur_result_destroy(&first);
   kschur_result_destroy(&second);
}

/* All stiffnesses larger by one part in four: d lambda/d p is lambda/2. */
static void rates(void)
{
   kschur_problem *problem = new_chain(n, 0, 0), *stiffer = new_chain(n, 0, 0);
   kschur_options *options = new_options(4);
   kschur_result *result = new_result();
   double complex lambda[4], rate[4];

   set_tridiagonal(stiffer, KSCHUR_STIFFNESS, n, 250, -125, -125);
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)lambda, 8));
   CHECK_OK(kschur_result_get_rates(result, problem, stiffer, 0.25, (double *)rate, 8));
   for (int j = 0; j < 4; j++) CHECK(cabs(rate[j] - lambda[j] / 2) < 1e-12);
   CHECK_STATUS(kschur_result_get_rates(result, problem, stiffer, 0, (double *)rate, 8), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_get_rates(result, problem, NULL, 1, (double *)rate, 8), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_rates(result, problem, stiffer, 1, (double *)rate, 7), KSCHUR_ERROR_LENGTH);
   CHECK_OK(kschur_result_get_message(result, text, sizeof text));
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&stiffer);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static int stop(void *context)
{
   return *(int *)context;
}

static int stop_after(void *context)
{
   return (*(int *)context)-- <= 0;
}

/* Of the chain on a spring and a dashpot: amplitudes in closed form of one mass, and by the equation of all. */
static void response(void)
{
   kschur_problem *problem = new_chain(n, 0.3, 0), *rigid = NULL;
   const double hz[2] = {0.5, 1.5};
   const int32_t row_start[2] = {0, 1}, column[1] = {0};
   const double one = 1;
   double complex f[2][n] = {{0}}, x[2][2][n];
   double complex single;

   f[0][0] = 1;
   f[1][4] = 2 * I;
   CHECK_OK(kschur_problem_get_response(problem, hz, 2, (double *)f, 2, NULL, (double *)x, NULL, NULL));
   for (int p = 0; p < 2; p++) {
      double complex s = 2 * pi * hz[p] * I;
      for (int k = 0; k < 2; k++)
         for (int i = 0; i < n; i++) {
            double complex left = i > 0 ? x[p][k][i - 1] : 0, right = i < n - 1 ? x[p][k][i + 1] : 0;
            CHECK(cabs((s * s + 0.3 * s + 200) * x[p][k][i] - 100 * (left + right) - f[k][i]) < 1e-12);
         }
   }
   CHECK_STATUS(kschur_problem_get_response(NULL, hz, 2, (double *)f, 2, NULL, (double *)x, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_get_response(problem, hz, 2, (double *)f, 2, NULL, NULL, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_get_response(problem, NULL, 2, (double *)f, 2, NULL, (double *)x, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_get_response(problem, hz, 2, (double *)f, 0, NULL, (double *)x, NULL, NULL), KSCHUR_ERROR_USAGE);
   CHECK_OK(kschur_problem_create(&rigid));
   CHECK_STATUS(kschur_problem_get_response(rigid, hz, 1, (double *)f, 1, NULL, (double *)x, NULL, NULL), KSCHUR_ERROR_ORDER);
   CHECK_OK(kschur_problem_set_csr(rigid, KSCHUR_MASS, 1, 1, 1, 0, row_start, column, &one));
   CHECK_OK(kschur_problem_set_csr(rigid, KSCHUR_STIFFNESS, 1, 1, 0, 0, (int32_t[2]){0, 0}, column, &one));
   CHECK_OK(kschur_problem_get_response(rigid, hz, 1, (double *)f, 1, NULL, (double *)&single, NULL, NULL));
   CHECK(cabs(single * pi * pi + 1) < 1e-14);
   CHECK_STATUS(kschur_problem_get_response(rigid, (double[1]){0}, 1, (double *)f, 1, NULL, (double *)&single, NULL, NULL),
                KSCHUR_ERROR_SINGULAR);
   CHECK_MESSAGE(problem, rigid, "no response at");
   for (int k = 0; k < 2; k++) {
      const int64_t many = ((int64_t)1 << 31) + k;
      CHECK_STATUS(kschur_problem_get_response(rigid, hz, k ? many : 1, (double *)f, k ? 1 : many, NULL, (double *)&single, NULL,
                                               NULL), KSCHUR_ERROR_USAGE);
      CHECK_MESSAGE(problem, rigid, k ? "not be 2147483649 and 1" : "not be 1 and 2147483648");
   }
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&rigid);
}

/* Ended each time that it is asked, a response has the frequencies before, which are those of a whole one. */
static void response_that_is_ended(void)
{
   kschur_problem *problem = new_chain(n, 0.3, 0);
   kschur_options *options = new_options(1);
   const double hz[5] = {0.5, 0.7, 0.9, 1.1, 1.3};
   double complex f[n] = {1}, whole[5][n], x[5][n];
   int64_t done = -1, before = 0;
   int left;

   CHECK_OK(kschur_options_set_stop(options, stop_after, &left));
   CHECK_OK(kschur_problem_get_response(problem, hz, 5, (double *)f, 1, NULL, (double *)whole, NULL, &done));
   CHECK(done == 5);
   for (int asked = 0; before < 5; asked++) {
      left = asked;
      for (int p = 0; p < 5; p++)
         for (int i = 0; i < n; i++) x[p][i] = -7;
      CHECK_OK(kschur_problem_get_response(problem, hz, 5, (double *)f, 1, options, (double *)x, NULL, &done));
      CHECK(done == before || done == before + 1);
      CHECK(asked > 0 || done == 0);
      for (int p = 0; p < 5; p++)
         for (int i = 0; i < n; i++) CHECK(cabs(x[p][i] - (p < done ? whole[p][i] : -7)) <= 1e-13 * cabs(whole[p][i]));
      if (done != before && done != before + 1) break;
      before = done;
   }
   CHECK_STATUS(kschur_problem_get_response(problem, hz, 5, (double *)f, 0, NULL, (double *)x, NULL, &done), KSCHUR_ERROR_USAGE);
   CHECK(done == 0);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
}

/* Of six points with two modes each, where only the last is kept. */
static void last_point_in_a_file(kschur_sweep *swept, kschur_result *result)
{
   kschur_result *kept[6] = {NULL, NULL, NULL, NULL, NULL, result}, *empty = NULL;
   kschur_sweep *again = NULL;
   double is_kept[6], shapes[2][8];

   CHECK_OK(kschur_result_create(&empty));
   CHECK_STATUS(kschur_sweep_write_hdf5_results(swept, "p", NULL, "points.h5", NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_sweep_write_hdf5_results(NULL, "p", NULL, "points.h5", kept), KSCHUR_ERROR_NULL);
   kept[1] = empty;
   CHECK_STATUS(kschur_sweep_write_hdf5_results(swept, "p", NULL, "points.h5", kept), KSCHUR_ERROR_ORDER);
   CHECK_MESSAGE(sweep, swept, "results[1]");
   kept[1] = NULL;
   CHECK_OK(kschur_sweep_write_hdf5_results(swept, "p", NULL, "points.h5", kept));
   CHECK_OK(kschur_sweep_create(&again));
   CHECK_OK(kschur_sweep_read_hdf5(again, "points.h5"));
   CHECK_OK(kschur_sweep_get_numbers(again, "kept", is_kept, 6));
   CHECK(is_kept[0] == 0 && is_kept[4] == 0 && is_kept[5] == 1);
   CHECK_STATUS(kschur_result_read_hdf5_point(NULL, "points.h5", 5), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_read_hdf5_point(empty, NULL, 5), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_read_hdf5_point(empty, "none.h5", 5), KSCHUR_ERROR_FILE);
   CHECK_STATUS(kschur_result_read_hdf5_point(empty, "points.h5", 4), KSCHUR_ERROR_INPUT);
   CHECK_STATUS(kschur_result_read_hdf5_point(empty, "points.h5", 6), KSCHUR_ERROR_INPUT);
   CHECK_OK(kschur_result_read_hdf5_point(empty, "points.h5", 5));
   CHECK_OK(kschur_result_get_numbers(result, "eigenvectors", shapes[0], 8));
   CHECK_OK(kschur_result_get_numbers(empty, "eigenvectors", shapes[1], 8));
   CHECK(memcmp(shapes[0], shapes[1], sizeof shapes[0]) == 0);
   remove("points.h5");
   kschur_sweep_destroy(&again);
   kschur_result_destroy(&empty);
}

/* Two oscillators of 1 + p and 2 - p, coupled: they veer at 1/2. */
static void sweep(void)
{
   kschur_options *options = new_options(2);
   kschur_sweep *swept = NULL;
   const int32_t row[4] = {0, 0, 1, 1}, column[4] = {0, 1, 0, 1};
   const double mass[4] = {1, 0, 0, 1};
   double complex lambda[6][2];
   double kind[3], first[3], at[3], last[4];
   kschur_result *result = NULL;
   int64_t branches, points, events;
   int stopped = 0;

   CHECK_OK(kschur_options_set_stop(options, stop, &stopped));
   CHECK_OK(kschur_sweep_create(&swept));
   CHECK_STATUS(kschur_sweep_get_size(swept, &branches, &points, &events), KSCHUR_ERROR_ORDER);
   CHECK_MESSAGE(sweep, swept, "kschur_sweep_add");
   for (int i = 0; i < 6; i++) {
      double p = 0.2 * i, stiffness[4] = {1 + p, 0.02, 0.02, 2 - p};
      kschur_problem *problem = NULL;
      CHECK_OK(kschur_problem_create(&problem));
      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_MASS, 2, 2, 4, 0, row, column, mass));
      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 2, 2, 4, 0, row, column, stiffness));
      stopped = 1;
      CHECK_OK(kschur_sweep_add(swept, p, problem, options));
      CHECK_OK(kschur_sweep_get_size(swept, NULL, &points, NULL));
      CHECK(points == i);
      stopped = 0;
      CHECK_OK(kschur_sweep_add(swept, p, problem, options));
      CHECK_STATUS(kschur_sweep_add(swept, p, problem, NULL), KSCHUR_ERROR_NULL);
      CHECK_STATUS(kschur_sweep_add(NULL, p, problem, options), KSCHUR_ERROR_NULL);
      kschur_problem_destroy(&problem);
   }
   CHECK_OK(kschur_sweep_get_size(swept, &branches, &points, &events));
   CHECK(branches == 2 && points == 6 && events == 1);
   CHECK_OK(kschur_sweep_get_numbers(swept, "eigenvalues", (double *)lambda, 24));
   for (int i = 0; i < 6; i++) {
      double root = hypot(0.2 * i - 0.5, 0.02);
      CHECK_NEAR(cimag(lambda[i][0]), sqrt(1.5 - root), 1e-12);
      CHECK_NEAR(cimag(lambda[i][1]), sqrt(1.5 + root), 1e-12);
   }
   CHECK_OK(kschur_sweep_get_numbers(swept, "event_kind", kind, 1));
   CHECK_OK(kschur_sweep_get_numbers(swept, "event_first", first, 1));
   CHECK_OK(kschur_sweep_get_numbers(swept, "event_value", at, 1));
   CHECK(kind[0] == 1 && first[0] == 0 && fabs(at[0] - 0.5) < 0.11);
   CHECK_STATUS(kschur_sweep_get_result(swept, NULL), KSCHUR_ERROR_NULL);
   CHECK_OK(kschur_result_create(&result));
   CHECK_OK(kschur_sweep_get_result(swept, result));
   CHECK_OK(kschur_result_get_numbers(result, "eigenvalues", last, 4));
   CHECK_NEAR(last[1], sqrt(1.5 - hypot(0.5, 0.02)), 1e-12);
   CHECK_NEAR(last[3], sqrt(1.5 + hypot(0.5, 0.02)), 1e-12);
   last_point_in_a_file(swept, result);
   kschur_result_destroy(&result);
   CHECK_STATUS(kschur_sweep_get_numbers(swept, "colour", kind, 1), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_sweep_get_numbers(swept, "eigenvalues", kind, 1), KSCHUR_ERROR_LENGTH);
   CHECK_OK(kschur_sweep_destroy(&swept));
   kschur_options_destroy(&options);
}

/* x'' + (p^2 - 2) x' + 100 x = 0: unstable below the root of 2. */
static int oscillator(void *context, double p, kschur_problem *problem)
{
   const int32_t zero = 0;
   const double one = 1, damping = p * p - 2, stiffness = 100;

   ++*(int *)context;
   if (p < 0) return 7;
   return kschur_problem_set_triplets(problem, KSCHUR_MASS, 1, 1, 1, 0, &zero, &zero, &one)
      || kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 1, 1, 1, 0, &zero, &zero, &damping)
      || kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 1, 1, 1, 0, &zero, &zero, &stiffness);
}

static void onset(void)
{
   kschur_options *options = new_options(1);
   kschur_sweep *swept = NULL, *again = NULL;
   kschur_result *result = NULL;
   const double at[2] = {2, 0.5};
   double value, within, unstable, branch;
   int64_t onsets = 0;
   int calls = 0;
   char text[8];

   CHECK_OK(kschur_sweep_create(&swept));
   CHECK_OK(kschur_sweep_set_problem(swept, oscillator, &calls));
   for (int i = 0; i < 2; i++) {
      kschur_problem *problem = NULL;
      CHECK_OK(kschur_problem_create(&problem));
      CHECK(oscillator(&calls, at[i], problem) == 0);
      CHECK_OK(kschur_sweep_add(swept, at[i], problem, options));
      kschur_problem_destroy(&problem);
   }
   CHECK(calls > 2);
   CHECK_OK(kschur_sweep_write_hdf5(swept, "p", "m", "onset.h5"));
   CHECK(kschur_is_sweep("onset.h5") == 1 && kschur_is_sweep("none.h5") == 0 && kschur_is_sweep(NULL) == 0);
   CHECK_OK(kschur_sweep_create(&again));
   CHECK_STATUS(kschur_sweep_read_hdf5(again, "none.h5"), KSCHUR_ERROR_FILE);
   CHECK_OK(kschur_sweep_read_hdf5(again, "onset.h5"));
   CHECK_OK(kschur_result_create(&result));
   CHECK_STATUS(kschur_sweep_get_result(again, result), KSCHUR_ERROR_ORDER);
   kschur_result_destroy(&result);
   CHECK_OK(kschur_sweep_get_parameter(again, text, 8));
   CHECK(strcmp(text, "p") == 0);
   CHECK_OK(kschur_sweep_get_unit(again, text, 8));
   CHECK(strcmp(text, "m") == 0);
   for (int i = 0; i < 2; i++) {
      kschur_sweep *one = i ? again : swept;
      CHECK_OK(kschur_sweep_get_onsets(one, &onsets));
      CHECK(onsets == 1);
      CHECK_OK(kschur_sweep_get_numbers(one, "onset_value", &value, 1));
      CHECK_OK(kschur_sweep_get_numbers(one, "onset_within", &within, 1));
      CHECK_OK(kschur_sweep_get_numbers(one, "onset_unstable", &unstable, 1));
      CHECK_OK(kschur_sweep_get_numbers(one, "onset_branch", &branch, 1));
      CHECK_NEAR(value, sqrt(2), 1e-4);
      CHECK(within <= 1.5e-3 && unstable == 1 && branch == 0);
   }
   remove("onset.h5");
   kschur_sweep_destroy(&swept);
   kschur_sweep_destroy(&again);
   kschur_options_destroy(&options);
}

int main(void)
{
   sweep();
   onset();
   response();
   response_that_is_ended();
   properties();
   mac();
   rates();
   return report_checks();
}
