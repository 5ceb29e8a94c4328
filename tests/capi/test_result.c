/* What a result gives, against closed forms and against the equations that it solves. */
#include <complex.h>

#include "models.h"

static char text[1000];

/* The rigid motion, three kinds of damping and their frequencies: four masses of 1 kg, not joined. */
static void kinds_frequencies_and_damping(void)
{
   const int32_t index[] = {0, 1, 2, 3, 4};
   const double mass[] = {1, 1, 1, 1, 1}, stiffness[] = {0, 100, 100, 100, 100}, damping[] = {0, 0, 2, 52, -2};
   static const int expected[] = {KSCHUR_KIND_RIGID, KSCHUR_KIND_OVERDAMPED, KSCHUR_KIND_UNDAMPED,
                                  KSCHUR_KIND_UNDERDAMPED, KSCHUR_KIND_UNSTABLE, KSCHUR_KIND_OVERDAMPED};
   kschur_problem *problem = NULL;
   kschur_options *options = new_options(6);
   kschur_result *result = new_result();
   double complex lambda[6];
   double frequency[6], damped[6], ratio[6], error[6], seconds[5];
   int64_t found, order, entries, applications, factorizations;
   int kind[6], reason, seen[6] = {0};

   CHECK_OK(kschur_problem_create(&problem));
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_MASS, 5, 5, 5, 0, index, index, mass));
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 5, 5, 5, 0, index, index, stiffness));
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 5, 5, 5, 0, index, index, damping));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_modes(result, &found, NULL));
   CHECK(found == 6);
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_CONVERGED);
   CHECK_OK(kschur_result_get_kinds(result, kind, 6));
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)lambda, 12));
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 6));
   CHECK_OK(kschur_result_get_damped_frequencies_hz(result, damped, 6));
   CHECK_OK(kschur_result_get_damping_ratios(result, ratio, 6));
   CHECK_OK(kschur_result_get_errors(result, error, 6));
   for (int i = 0; i < 6; ++i) CHECK(error[i] >= 0 && error[i] < 1e-6);
   CHECK_OK(kschur_result_get_backward_errors(result, error, 6));
   for (int j = 0; j < 6; j++) {
      if (kind[j] >= 0 && kind[j] < 6) seen[kind[j]]++;
      CHECK(error[j] >= 0 && error[j] < 1e-12);
      switch (kind[j]) {
      case KSCHUR_KIND_RIGID:
         CHECK(lambda[j] == 0 && frequency[j] == 0 && isnan(ratio[j]));
         break;
      case KSCHUR_KIND_UNDAMPED:
         CHECK(cabs(lambda[j] - 10 * I) < 1e-12);
         break;
      case KSCHUR_KIND_UNDERDAMPED:
         CHECK(cabs(lambda[j] - (-1 + sqrt(99) * I)) < 1e-12);
         CHECK_NEAR(frequency[j], 10 / (2 * pi), 1e-13);
         CHECK_NEAR(damped[j], sqrt(99) / (2 * pi), 1e-13);
         CHECK_NEAR(ratio[j], 0.1, 1e-14);
         break;
      case KSCHUR_KIND_UNSTABLE:
         CHECK(cabs(lambda[j] - (1 + sqrt(99) * I)) < 1e-12);
         CHECK_NEAR(ratio[j], -0.1, 1e-14);
         break;
      case KSCHUR_KIND_OVERDAMPED: /* 52 = 2 + 50, and 2 times 50 is 100 */
         CHECK(cabs(lambda[j] + 2) < 1e-12 || cabs(lambda[j] + 50) < 1e-11);
         CHECK_NEAR(frequency[j], 10 / (2 * pi), 1e-12);
         CHECK(damped[j] == 0);
         CHECK_NEAR(ratio[j], 2.6, 1e-12);
         break;
      default:
         CHECK(0);
      }
   }
   for (int j = 0; j < 6; j++) CHECK(seen[expected[j]] == (expected[j] == KSCHUR_KIND_OVERDAMPED ? 2 : 1));

   CHECK_OK(kschur_result_get_method(result, text, sizeof text));
   CHECK(strcmp(text, "krylov-schur") == 0);
   CHECK_OK(kschur_result_get_decision(result, text, sizeof text));
   CHECK(strlen(text) > 0);
   CHECK_OK(kschur_result_get_counts(result, &applications, NULL, &factorizations));
   CHECK(applications > 0 && factorizations > 0);
   CHECK_OK(kschur_result_get_factors(result, &order, &entries));
   CHECK(order == 5 && entries >= 5);
   CHECK_OK(kschur_result_get_seconds(result, seconds, seconds + 1, seconds + 2, seconds + 3, seconds + 4));
   for (int i = 1; i < 5; i++) CHECK(seconds[i] >= 0 && seconds[i] <= seconds[0]);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

/* The unsymmetric chain with a dashpot and a tie: each mode satisfies both equations, its left vector its own. */
static void vectors_satisfy_their_equations(void)
{
   enum { n = 12, modes = 5 };
   const int first[] = {3}, second[] = {7};
   kschur_problem *problem = new_chain_with_dashpot(n, 3);
   kschur_options *options = new_options(modes);
   kschur_result *result = new_result();
   double complex lambda[modes], phi[modes][n], xi[modes], psi[modes][n], eta[modes];
   double condition[modes];
   int64_t unknowns, constraints;

   set_tridiagonal(problem, KSCHUR_STIFFNESS, n, 200, -90, -100);
   tie(problem, n, 1, first, second);
   CHECK_OK(kschur_options_set_left(options, 1));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_size(result, &unknowns, &constraints));
   CHECK(unknowns == n && constraints == 1);
   CHECK_OK(kschur_result_get_eigenvalues(result, (double *)lambda, 2 * modes));
   CHECK_OK(kschur_result_get_eigenvectors(result, (double *)phi, 2 * n * modes));
   CHECK_OK(kschur_result_get_multipliers(result, (double *)xi, 2 * modes));
   CHECK_OK(kschur_result_get_left_eigenvectors(result, (double *)psi, 2 * n * modes));
   CHECK_OK(kschur_result_get_left_multipliers(result, (double *)eta, 2 * modes));
   CHECK_OK(kschur_result_get_condition_numbers(result, condition, modes));

   for (int j = 0; j < modes; j++) {
      double norm = 0, left_norm = 0;
      CHECK(cimag(lambda[j]) > 0 && creal(lambda[j]) < 0);
      for (int i = 0; i < n; i++) {
         double tied = i == 3 ? 1 : i == 7 ? -1 : 0;
         double complex diagonal = lambda[j] * lambda[j] + 200 + (i == 0 ? 3 * lambda[j] : 0);
         double complex right = diagonal * phi[j][i] + tied * xi[j], left = conj(psi[j][i]) * diagonal + tied * conj(eta[j]);
         if (i > 0) right -= 90 * phi[j][i - 1], left -= 100 * conj(psi[j][i - 1]);
         if (i < n - 1) right -= 100 * phi[j][i + 1], left -= 90 * conj(psi[j][i + 1]);
         CHECK(cabs(right) < 1e-10 && cabs(left) < 1e-9);
         norm += creal(phi[j][i] * conj(phi[j][i]));
         left_norm += creal(psi[j][i] * conj(psi[j][i]));
      }
      CHECK_NEAR(norm, 1, 1e-13);
      CHECK_NEAR(left_norm, 1, 1e-13);
      CHECK(cabs(phi[j][3] - phi[j][7]) < 1e-13);
      CHECK(condition[j] > 0 && condition[j] < 1e3);
   }
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void lengths(void)
{
   kschur_problem *problem = new_chain(4, 0, 0.01);
   kschur_options *options = new_options(3);
   kschur_result *result = new_result();
   double values[30];
   int kinds[3], status;

   tie(problem, 4, 1, (const int[]){0}, (const int[]){3});
   CHECK_OK(kschur_options_set_left(options, 1));
   CHECK_OK(kschur_solve(problem, options, result));
   /* One less than is needed: nothing is written. */
   values[0] = -7;
   CHECK_STATUS(kschur_result_get_eigenvalues(result, values, 3), KSCHUR_ERROR_LENGTH);
   CHECK(values[0] == -7);
   CHECK_STATUS(kschur_result_get_eigenvectors(result, values, 15), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_eigenvalues(result, values, -1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_left_eigenvectors(result, values, 15), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_multipliers(result, values, 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_left_multipliers(result, values, 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_frequencies_hz(result, values, 1), KSCHUR_ERROR_LENGTH);
   CHECK_MESSAGE(result, result, "a length of 1 but needs ");
   CHECK_STATUS(kschur_result_get_damped_frequencies_hz(result, values, 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_damping_ratios(result, values, 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_backward_errors(result, values, 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_condition_numbers(result, values, 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_kinds(result, kinds, 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_history(result, NULL, NULL, values, 0), KSCHUR_ERROR_LENGTH);
   CHECK_MESSAGE(result, result, "a length of 0 but need ");
   CHECK(values[0] == -7);

   /* Texts are cut, and still end. */
   CHECK_STATUS(kschur_result_get_method(result, text, 7), KSCHUR_ERROR_LENGTH);
   CHECK(strcmp(text, "krylov") == 0);
   CHECK_MESSAGE(result, result, "needs a length of 13");
   CHECK_STATUS(kschur_result_get_method(result, text, 12), KSCHUR_ERROR_LENGTH);
   CHECK_OK(kschur_result_get_method(result, text, 13));
   CHECK(strcmp(text, "krylov-schur") == 0);
   strcpy(text, "x");
   CHECK_STATUS(kschur_result_get_method(result, text, 0), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_method(result, text, -5), KSCHUR_ERROR_LENGTH);
   CHECK(strcmp(text, "x") == 0);
   CHECK_STATUS(kschur_result_get_method(result, text, 1), KSCHUR_ERROR_LENGTH);
   CHECK(strcmp(text, "") == 0);
   CHECK_STATUS(kschur_result_get_message(result, text, 4), KSCHUR_ERROR_LENGTH);
   CHECK(strcmp(text, "the") == 0);
   /* A message that is read stays. */
   CHECK_MESSAGE(result, result, "needs a length of 13");

   CHECK_OK(kschur_kind_name(KSCHUR_KIND_UNDERDAMPED, text, sizeof text));
   CHECK(strcmp(text, "underdamped") == 0);
   CHECK_OK(kschur_kind_name(KSCHUR_KIND_REAL, text, sizeof text));
   CHECK(strcmp(text, "real") == 0);
   CHECK_STATUS(kschur_kind_name(6, text, sizeof text), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_kind_name(-1, text, sizeof text), KSCHUR_ERROR_USAGE);
   CHECK_OK(kschur_reason_name(KSCHUR_REASON_INACCURATE, text, sizeof text));
   CHECK(strcmp(text, "inaccurate") == 0);
   CHECK_OK(kschur_reason_name(KSCHUR_REASON_CANCELLED, text, sizeof text));
   CHECK(strcmp(text, "cancelled") == 0);
   CHECK_OK(kschur_reason_name(KSCHUR_REASON_INTERRUPTED, text, sizeof text));
   CHECK(strcmp(text, "interrupted") == 0);
   CHECK_STATUS(kschur_reason_name(6, text, sizeof text), KSCHUR_ERROR_USAGE);
   for (status = -1; status < 30; status++) {
      int known = (status >= KSCHUR_OK && status <= KSCHUR_ERROR_CONVERGENCE) ||
                  (status >= KSCHUR_ERROR_NULL && status <= KSCHUR_ERROR_CALLBACK);
      CHECK_STATUS(kschur_status_text(status, text, sizeof text), known ? KSCHUR_OK : KSCHUR_ERROR_USAGE);
      if (status == KSCHUR_ERROR_CONVERGENCE) CHECK(strstr(text, "iterates") != NULL);
      if (status == KSCHUR_ERROR_NULL) CHECK(strstr(text, "null") != NULL);
      if (status == KSCHUR_ERROR_CALLBACK) CHECK(strstr(text, "callback") != NULL);
   }

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

/* Two constraints that say the same; more modes asked for than there are. */
static void notes_and_reason(void)
{
   kschur_problem *problem = new_chain(4, 0, 0);
   kschur_options *options = new_options(10);
   kschur_result *result = new_result();
   int64_t count, found, asked;
   int reason, certified;

   tie(problem, 4, 2, (const int[]){0, 3}, (const int[]){3, 0});
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_modes(result, &found, &asked));
   CHECK(found == 3 && asked == 10);
   CHECK_OK(kschur_result_get_reason(result, &reason));
   CHECK(reason == KSCHUR_REASON_FEWER_MODES);
   CHECK_OK(kschur_result_get_certified(result, &certified));
   CHECK(certified == KSCHUR_CERTIFIED_UNKNOWN);
   CHECK_OK(kschur_result_get_redundant_constraints(result, &count));
   CHECK(count == 1);
   CHECK_OK(kschur_result_get_note_count(result, &count));
   CHECK(count == 2);
   CHECK_OK(kschur_result_get_note(result, 0, text, 201));
   CHECK(strstr(text, "1 of 2 constraints") != NULL);
   CHECK_OK(kschur_result_get_note(result, 1, text, 201));
   CHECK(strstr(text, "of 10 modes there are 6 at most") != NULL);
   CHECK_STATUS(kschur_result_get_note(result, 2, text, 201), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_get_note(result, -1, text, 201), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_get_note(result, INT64_MAX, text, 201), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "there is no note");

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void bands(void)
{
   kschur_problem *problem = new_chain(40, 0, 0.001);
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();
   double frequency[40];
   int64_t found;
   int certified;

   /* Modes 11 to 20. */
   CHECK_OK(kschur_solve_band(problem, (chain_omega(40, 10) + chain_omega(40, 11)) / (4 * pi),
                              (chain_omega(40, 20) + chain_omega(40, 21)) / (4 * pi), options, result));
   CHECK_OK(kschur_result_get_modes(result, &found, NULL));
   CHECK(found == 10);
   CHECK_OK(kschur_result_get_certified(result, &certified));
   CHECK(certified == KSCHUR_CERTIFIED_YES);
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 40));
   for (int j = 0; j < 10; j++) CHECK_NEAR(frequency[j], chain_omega(40, 11 + j) / (2 * pi), 1e-12);

   CHECK_OK(kschur_solve_band(problem, 5, 6, options, result));
   CHECK_OK(kschur_result_get_modes(result, &found, NULL));
   CHECK(found == 0);
   CHECK_OK(kschur_result_get_eigenvalues(result, NULL, 0));
   CHECK_STATUS(kschur_solve_band(problem, 6, 5, options, result), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "a band wants two frequencies");
   CHECK_STATUS(kschur_solve_band(problem, -1, 5, options, result), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_solve_band(problem, 0, NAN, options, result), KSCHUR_ERROR_USAGE);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void files(void)
{
   kschur_problem *problem = new_chain_with_dashpot(10, 3);
   kschur_options *options = new_options(3);
   kschur_result *result = new_result(), *copy = new_result();
   double before[60], after[60], residual[100];
   int64_t looks, counted[100], applied[100], total;
   int kinds[3];

   CHECK_OK(kschur_options_set_left(options, 1));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_write_hdf5(result, "capi_result.h5"));
   CHECK_OK(kschur_result_read_hdf5(copy, "capi_result.h5"));
   CHECK_OK(kschur_result_get_eigenvectors(result, before, 60));
   CHECK_OK(kschur_result_get_eigenvectors(copy, after, 60));
   CHECK(memcmp(before, after, sizeof before) == 0);
   CHECK_OK(kschur_result_get_left_eigenvectors(result, before, 60));
   CHECK_OK(kschur_result_get_left_eigenvectors(copy, after, 60));
   CHECK(memcmp(before, after, sizeof before) == 0);
   CHECK_OK(kschur_result_get_kinds(copy, kinds, 3));
   CHECK(kinds[0] == KSCHUR_KIND_UNDERDAMPED);
   CHECK_OK(kschur_result_get_inner(result, text, sizeof text));
   CHECK_OK(kschur_result_get_history_count(copy, &looks));
   CHECK(looks > 0 && looks <= 100);
   CHECK_OK(kschur_result_get_history(copy, counted, applied, residual, 100));
   CHECK_OK(kschur_result_get_counts(copy, &total, NULL, NULL));
   for (int64_t i = 1; i < looks; i++) CHECK(applied[i] >= applied[i - 1]);
   CHECK(applied[looks - 1] <= total && residual[looks - 1] < 1e-6 && counted[looks - 1] >= 3);

   CHECK_STATUS(kschur_result_write_hdf5(result, "capi_no_folder/result.h5"), KSCHUR_ERROR_FILE);
   CHECK_STATUS(kschur_result_read_hdf5(copy, "capi_missing.h5"), KSCHUR_ERROR_FILE);
   CHECK_MESSAGE(result, copy, "capi_missing.h5: no such file");
   /* A problem is no result; the result stays as it was. */
   CHECK_OK(kschur_problem_write_hdf5(problem, "capi_result.h5"));
   CHECK_STATUS(kschur_result_read_hdf5(copy, "capi_result.h5"), KSCHUR_ERROR_INPUT);
   CHECK_OK(kschur_result_get_left_eigenvectors(copy, after, 60));
   CHECK(memcmp(before, after, sizeof before) == 0);

   remove("capi_result.h5");
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
   kschur_result_destroy(&copy);
}

static void version(void)
{
   int major = -1, minor = -1, patch = -1;

   CHECK_OK(kschur_version(&major, &minor, &patch));
   CHECK(major == KSCHUR_VERSION_MAJOR && minor == KSCHUR_VERSION_MINOR && patch == KSCHUR_VERSION_PATCH);
   CHECK(KSCHUR_VERSION == 10000 * major + 100 * minor + patch);
}

int main(void)
{
   kinds_frequencies_and_damping();
   vectors_satisfy_their_equations();
   lengths();
   notes_and_reason();
   bands();
   files();
   version();
   return report_checks();
}
