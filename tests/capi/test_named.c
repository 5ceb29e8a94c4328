/* Options and results by name, parts of shapes, where a problem stands, and what messages count from. */
#include <complex.h>

#include "models.h"

enum { n = 40, modes = 5 };

static double last_number(kschur_result *result, const char *name)
{
   double value = -12345;

   CHECK_OK(kschur_result_get_numbers(result, name, &value, 1));
   return value;
}

/* Those of the setters. */
static void options_by_name(void)
{
   static const char *const pairs[][2] = {
      {"modes", "5"}, {"target", "0,6.5"}, {"target", "-1e-1"}, {"target_hz", "1.5"}, {"shift", "0.25,-1"}, {"method", "arpack"},
      {"arpack", "plain"}, {"arpack", "fair"}, {"method", "krylov-schur"}, {"formulation", "quadratic"}, {"inner", "mumps"},
      {"constraint_scaling", "none"}, {"normalisation", "mass"}, {"subspace", "30"}, {"tolerance", "1e-10"},
      {"max_restarts", "50"}, {"block", "2"}, {"threads", "1"}, {"seed", "7"}, {"presolve", "off"}, {"left", "on"},
      {"certify", "on"}, {"certify", "off"}, {"memory", "8000000000"}, {"memory", "0"}};
   static const char *const wrong[][2] = {
      {"mode", "5"}, {"modes", "five"}, {"modes", ""}, {"modes", "5 6"}, {"modes", "0"}, {"tolerance", "2"}, {"tolerance", "1e"},
      {"target", "1,2,3"}, {"target", ","}, {"left", "maybe"}, {"memory", "-1"}, {"formulation", "best"}, {"modes", "99999999999999999999999"}};
   kschur_problem *problem = new_chain_with_dashpot(n, 1.0);
   kschur_options *options = new_options(3);
   kschur_result *result = new_result();
   char text[100];
   double shift[2];

   for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) CHECK_OK(kschur_options_set(options, pairs[k][0], pairs[k][1]));
   for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++)
      CHECK_STATUS(kschur_options_set(options, wrong[k][0], wrong[k][1]), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_options_set(options, "modes", "five"), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "'modes' wants a whole number, not 'five'");
   CHECK_STATUS(kschur_options_set(options, "colour", "red"), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(options, options, "no option 'colour'");
   CHECK_STATUS(kschur_options_set(NULL, "modes", "5"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set(options, NULL, "5"), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_options_set(options, "modes", NULL), KSCHUR_ERROR_NULL);
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK(last_number(result, "modes_asked") == 5 && last_number(result, "modes") == 5);
   CHECK_OK(kschur_result_get_numbers(result, "shift", shift, 2));
   CHECK(shift[0] == 0.25 && shift[1] == -1);
   CHECK_OK(kschur_result_get_numbers(result, "target", shift, 2));
   CHECK_NEAR(shift[1], 3 * pi, 1e-14);
   CHECK_OK(kschur_result_get_text(result, "formulation", text, 100));
   CHECK(strcmp(text, "quadratic") == 0);
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
}

/* A name gives what the getter gives, and that is right. */
static void results_by_name(void)
{
   kschur_problem *problem = new_chain(n, 0, 0);
   kschur_options *options = new_options(modes);
   kschur_result *result = new_result();
   double lambda[2 * modes], by_name[2 * modes], *shapes = malloc(2 * n * modes * sizeof *shapes);
   int64_t length = 0;
   char text[100];

   CHECK_STATUS(kschur_result_get_numbers(result, "n", by_name, 1), KSCHUR_ERROR_ORDER);
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_length(result, "eigenvalues", &length));
   CHECK(length == 2 * modes);
   CHECK_OK(kschur_result_get_numbers(result, "eigenvalues", by_name, length));
   CHECK_OK(kschur_result_get_eigenvalues(result, lambda, 2 * modes));
   CHECK(memcmp(lambda, by_name, sizeof lambda) == 0);
   CHECK_OK(kschur_result_get_numbers(result, "frequency_hz", by_name, modes));
   for (int j = 0; j < modes; j++) {
      CHECK_NEAR(lambda[2 * j + 1], chain_omega(n, j + 1), 1e-12);
      CHECK_NEAR(by_name[j], chain_omega(n, j + 1) / (2 * pi), 1e-12);
   }
   CHECK_OK(kschur_result_get_numbers(result, "kind", by_name, modes));
   CHECK(by_name[0] == KSCHUR_KIND_UNDAMPED);
   CHECK(last_number(result, "n") == n && last_number(result, "m") == 0 && last_number(result, "reason") == KSCHUR_REASON_CONVERGED);
   CHECK(last_number(result, "certified") == KSCHUR_CERTIFIED_YES && last_number(result, "seconds_total") > 0);
   CHECK(last_number(result, "seconds_judge") > 0 && last_number(result, "seconds_judge") < last_number(result, "seconds_total"));
   CHECK_OK(kschur_result_get_length(result, "eigenvectors", &length));
   CHECK(length == 2 * n * modes);
   CHECK_OK(kschur_result_get_numbers(result, "eigenvectors", shapes, length));
   CHECK_STATUS(kschur_result_get_numbers(result, "eigenvectors", shapes, length - 1), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_numbers(result, "colour", shapes, length), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "no numbers 'colour'");
   CHECK_STATUS(kschur_result_get_numbers(result, "left_eigenvectors", shapes, length), KSCHUR_ERROR_ORDER);
   CHECK_MESSAGE(result, result, "'left_eigenvectors'");
   CHECK_STATUS(kschur_result_get_numbers(result, "coordinates", shapes, length), KSCHUR_ERROR_ORDER);
   CHECK_STATUS(kschur_result_get_numbers(result, "modal_a", shapes, length), KSCHUR_ERROR_ORDER);
   CHECK_OK(kschur_result_find_properties(result, problem, NULL, 0));
   CHECK_OK(kschur_result_get_numbers(result, "generalised_mass", by_name, modes));
   CHECK_NEAR(by_name[2], 1, 1e-12);
   CHECK_OK(kschur_result_get_text(result, "reason", text, 100));
   CHECK(strcmp(text, "converged") == 0);
   CHECK_STATUS(kschur_result_get_text(result, "colour", text, 100), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_get_numbers(NULL, "n", by_name, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_numbers(result, NULL, by_name, 1), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_numbers(result, "eigenvectors", NULL, length), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_length(NULL, "n", &length), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_text(NULL, "reason", text, 100), KSCHUR_ERROR_NULL);
   free(shapes);
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
}

/* Shapes of an undamped chain are sines, real; those of a chain with a dashpot are not. */
static void parts(void)
{
   const int64_t rows[] = {39, 0, 7};
   kschur_problem *problem = new_chain(n, 0, 0), *damped = new_chain_with_dashpot(n, 1.0);
   kschur_options *options = new_options(modes);
   kschur_result *result = new_result();
   kschur_part part = {0};
   double complex all[n * modes], some[n * modes];
   double real[n * modes];
   int is_real = -1;

   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvectors(result, (double *)all, 2 * n * modes));
   CHECK_OK(kschur_result_get_part(result, "eigenvectors", &part, (double *)some, 2 * n * modes));
   CHECK(memcmp(all, some, sizeof all) == 0);
   CHECK_OK(kschur_result_is_real(result, "eigenvectors", 2, &is_real));
   CHECK(is_real == 1);
   part.first = 2;
   part.count = 2;
   part.rows = rows;
   part.row_count = 3;
   part.real = 1;
   CHECK_OK(kschur_result_get_part(result, "eigenvectors", &part, real, 6));
   for (int j = 0; j < 2; j++)
      for (int i = 0; i < 3; i++) {
         double sine = sin((j + 3) * pi * (rows[i] + 1) / (n + 1)) * sqrt(2.0 / (n + 1));
         CHECK_NEAR(fabs(real[3 * j + i]), fabs(sine), 1e-12);
         CHECK(real[3 * j + i] == creal(all[(j + 2) * n + rows[i]]));
      }
   part.real = 0;
   CHECK_OK(kschur_result_get_part(result, "eigenvectors", &part, (double *)some, 12));
   CHECK(some[4] == all[3 * n]);
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, (double *)some, 11), KSCHUR_ERROR_LENGTH);
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, NULL, 12), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_result_get_part(result, "frequency_hz", &part, real, 12), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", NULL, real, 12), KSCHUR_ERROR_NULL);
   part.count = 4;
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   part.first = -1;
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   part = (kschur_part){.rows = (const int64_t[]){40}, .row_count = 1};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "rows must lie between 0 and 39");
   /* Counts that no product and no sum can hold, rows that cannot be there. */
   part = (kschur_part){.first = INT64_MAX, .count = INT64_MAX};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   part = (kschur_part){.first = 1, .count = INT64_MAX};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   part = (kschur_part){.first = INT64_MIN};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   part = (kschur_part){.rows = rows, .row_count = INT64_MAX};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, INT64_MAX - 1), KSCHUR_ERROR_LENGTH);
   part.row_count = INT64_MAX / 2 + 1;
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_LENGTH);
   part.row_count = -1;
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "there cannot be -1 rows");
   part = (kschur_part){.row_count = 3};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_NULL);
   part = (kschur_part){.rows = (const int64_t[]){INT64_MAX}, .row_count = 1};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, 100), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_is_real(result, "eigenvectors", 5, &is_real), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_result_is_real(result, "kind", 0, &is_real), KSCHUR_ERROR_USAGE);

   CHECK_OK(kschur_solve(damped, options, result));
   CHECK_OK(kschur_result_is_real(result, "eigenvectors", 0, &is_real));
   CHECK(is_real == 0);
   part = (kschur_part){.real = 1};
   CHECK_STATUS(kschur_result_get_part(result, "eigenvectors", &part, real, n * modes), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(result, result, "not all of these modes are real");
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&damped);
}

/* A chain that moves along x, its nodes one metre apart; the last unknown has no node. Written, read, solved. */
static void nodes_and_cells(void)
{
   const int32_t offset[] = {0, 2, 4}, corner[] = {1, 2, 2, 3}, type[] = {3, 3};
   int32_t node[n], component[n] = {0};
   double coordinates[3 * n] = {0}, found[3 * n];
   kschur_problem *problem = new_chain(n, 0, 0), *read = NULL, *bare = NULL;
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();

   for (int i = 0; i < n; i++) {
      node[i] = i == n - 1 ? 0 : n - 1 - i;
      coordinates[3 * i] = i;
   }
   CHECK_STATUS(kschur_problem_set_cells(problem, 2, 1, offset, corner, type), KSCHUR_ERROR_ORDER);
   CHECK_OK(kschur_problem_set_nodes(problem, n, coordinates, n, 1, node, component));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_numbers(result, "cells_connectivity", found, 2 * (n - 2)));
   CHECK(found[0] == 0 && found[1] == 1 && found[2 * (n - 2) - 1] == n - 2);
   CHECK_OK(kschur_problem_set_cells(problem, 2, 1, offset, corner, type));
   CHECK_OK(kschur_problem_write_hdf5(problem, "test_named.h5"));
   CHECK_OK(kschur_problem_create(&read));
   CHECK_OK(kschur_problem_read_hdf5(read, "test_named.h5"));
   remove("test_named.h5");
   CHECK_OK(kschur_solve(read, options, result));
   CHECK_OK(kschur_result_get_numbers(result, "coordinates", found, 3 * n));
   CHECK(memcmp(found, coordinates, sizeof found) == 0);
   CHECK_OK(kschur_result_get_numbers(result, "unknown_node", found, n));
   for (int i = 0; i < n; i++) CHECK(found[i] == node[i] - 1);
   CHECK_OK(kschur_result_get_numbers(result, "cells_connectivity", found, 4));
   CHECK(found[0] == 0 && found[1] == 1 && found[2] == 1 && found[3] == 2);
   CHECK_OK(kschur_result_get_numbers(result, "cells_types", found, 2));
   CHECK(found[1] == 3);

   /* Of n unknowns n + 1 that move nodes, the last as the first. */
   {
      int32_t row_start[n + 2], column[n + 1], more[n + 1] = {0}, kind[n + 1] = {0};
      double value[n + 1];

      for (int i = 0; i <= n; i++) {
         row_start[i + 1] = i + 2;
         column[i] = i == n ? 1 : i + 1;
         value[i] = 2 + i;
      }
      row_start[0] = 1;
      CHECK_OK(kschur_problem_create(&bare));
      CHECK_STATUS(kschur_problem_set_csr(bare, KSCHUR_TRANSFORMATION, n + 1, n, n + 1, 1, row_start, column, value), KSCHUR_ERROR_ORDER);
      kschur_problem_destroy(&bare);
      CHECK_OK(kschur_problem_set_nodes(problem, n, coordinates, n + 1, 1, more, kind));
      CHECK_OK(kschur_problem_set_csr(problem, KSCHUR_TRANSFORMATION, n + 1, n, n + 1, 1, row_start, column, value));
      CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_INPUT);
      CHECK_MESSAGE(result, result, "the cells must be given");
      CHECK_OK(kschur_problem_set_cells(problem, 2, 1, offset, corner, type));
      CHECK_OK(kschur_solve(problem, options, result));
      CHECK_OK(kschur_result_get_numbers(result, "transformation_data", found, n + 1));
      CHECK(memcmp(found, value, sizeof value) == 0);
      CHECK_OK(kschur_result_get_numbers(result, "transformation_indices", found, n + 1));
      CHECK(found[0] == 0 && found[n - 1] == n - 1 && found[n] == 0);
   }

   component[3] = 6;
   CHECK_STATUS(kschur_problem_set_nodes(problem, n, coordinates, n, 1, node, component), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "component[3] is 6 but must lie between -1 and 5");
   CHECK_STATUS(kschur_problem_set_nodes(problem, n, coordinates, n, 2, NULL, NULL), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_problem_set_nodes(problem, INT32_MAX, coordinates, n, 1, NULL, NULL), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "2147483647 nodes");
   CHECK_STATUS(kschur_problem_set_nodes(problem, n, coordinates, (int64_t)1 << 32, 1, NULL, NULL), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "4294967296 unknowns");
   CHECK_STATUS(kschur_problem_set_cells(problem, INT32_MAX, 1, offset, corner, type), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "2147483647 cells");
   CHECK_STATUS(kschur_problem_set_nodes(problem, n, NULL, n, 1, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_nodes(problem, n, coordinates, n, 1, node, NULL), KSCHUR_ERROR_NULL);
   CHECK_STATUS(kschur_problem_set_nodes(NULL, n, coordinates, n, 1, NULL, NULL), KSCHUR_ERROR_NULL);
   CHECK_OK(kschur_problem_set_nodes(problem, n - 1, coordinates, n, 1, NULL, NULL));
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(result, result, "40 unknowns are not 1, 2, 3 or 6 for each of 39 nodes");
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&read);
}

/* Entry (2, 3), counted from 0, is no number; row 1 of the constraints is empty. */
static void messages_count_from_the_base(void)
{
   for (int base = 0; base < 2; base++) {
      const int32_t row = 2 + base, column = 3 + base, first = base;
      const double value = NAN, one = 1;
      kschur_problem *problem = new_chain(5, 0, 0);

      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 5, 5, 1, base, &row, &column, &value));
      CHECK_STATUS(kschur_problem_get_size(problem, NULL, NULL), KSCHUR_ERROR_INPUT);
      CHECK_MESSAGE(problem, problem, base == 0 ? "(2, 3)" : "(3, 4)");
      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 5, 5, 0, base, NULL, NULL, NULL));
      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_CONSTRAINTS, 2, 5, 1, base, &first, &first, &one));
      CHECK_STATUS(kschur_problem_get_size(problem, NULL, NULL), KSCHUR_ERROR_INPUT);
      CHECK_MESSAGE(problem, problem, base == 0 ? "row 1 of the constraint" : "row 2 of the constraint");
      kschur_problem_destroy(&problem);
   }
}

static void check_notes(kschur_result *result, int base)
{
   char notes[500];

   CHECK_OK(kschur_result_get_text(result, "notes", notes, 500));
   if (strstr(notes, base == 0 ? "modes 0 and 1 (counted from 0)" : "modes 1 and 2 are") == NULL) {
      printf("the notes are \"%s\"\n", notes);
      checks_failed++;
   }
}

/* Two masses with one eigenvalue and one shape: the note counts as the caller does, also where a solver has had other
   values before. */
static void notes_count_from_the_base(void)
{
   for (int base = 0; base < 2; base++) {
      const int32_t index[] = {base, base + 1}, row[] = {base, base + 1, base}, column[] = {base, base + 1, base + 1};
      const double mass[] = {1, 1}, stiffness[] = {100, 100, 1};
      kschur_problem *problem = NULL;
      kschur_options *options = new_options(2);
      kschur_result *result = new_result();
      kschur_solver *solver = NULL;

      CHECK_OK(kschur_problem_create(&problem));
      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_MASS, 2, 2, 2, base, index, index, mass));
      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 2, 2, 3, base, row, column, stiffness));
      CHECK_OK(kschur_problem_set_symmetric(problem, "no"));
      CHECK_OK(kschur_solve(problem, options, result));
      check_notes(result, base);
      CHECK_OK(kschur_solver_create(&solver));
      for (int round = 0; round < 2; round++) {
         CHECK_OK(kschur_solver_set_problem(solver, problem));
         CHECK_OK(kschur_solver_solve(solver, options, result));
         check_notes(result, base);
      }
      kschur_solver_destroy(&solver);
      kschur_result_destroy(&result);
      kschur_options_destroy(&options);
      kschur_problem_destroy(&problem);
   }
}

int main(void)
{
   options_by_name();
   results_by_name();
   parts();
   nodes_and_cells();
   messages_count_from_the_base();
   notes_count_from_the_base();
   return report_checks();
}
