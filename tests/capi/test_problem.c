/* Problems from arrays of every kind and from files, and what is wrong with them. */
#include "models.h"

/* The chain of three masses, tridiagonal stiffness, in every layout that there is. */
static const int64_t csr_start[] = {0, 2, 5, 7}, csr_column[] = {0, 1, 0, 1, 2, 1, 2};
static const int64_t triplet_row[] = {2, 2, 1, 1, 1, 0, 0};
static const int64_t triplet_column[] = {2, 1, 2, 1, 0, 1, 0};
static const double csr_value[] = {200, -100, -100, 200, -100, -100, 200};
static const double triplet_value[] = {200, -100, -100, 200, -100, -100, 200};

static kschur_problem *with_mass(void)
{
   kschur_problem *problem = NULL;

   CHECK_OK(kschur_problem_create(&problem));
   set_tridiagonal(problem, KSCHUR_MASS, 3, 1, 0, 0);
   return problem;
}

static int64_t *shifted(const int64_t *list, int count, int by)
{
   int64_t *copy = malloc(count * sizeof *copy);

   for (int i = 0; i < count; i++) copy[i] = list[i] + by;
   return copy;
}

static int32_t *narrowed(const int64_t *list, int count)
{
   int32_t *copy = malloc(count * sizeof *copy);

   for (int i = 0; i < count; i++) copy[i] = (int32_t)list[i];
   return copy;
}

static void set_stiffness(kschur_problem *problem, int compressed, int wide, int base)
{
   int64_t *row = compressed ? shifted(csr_start, 4, base) : shifted(triplet_row, 7, base);
   int64_t *column = shifted(compressed ? csr_column : triplet_column, 7, base);
   int32_t *row32 = narrowed(row, compressed ? 4 : 7), *column32 = narrowed(column, 7);
   double value[7];

   memcpy(value, compressed ? csr_value : triplet_value, sizeof value);
   if (compressed && wide)
      CHECK_OK(kschur_problem_set_csr64(problem, KSCHUR_STIFFNESS, 3, 3, 7, base, row, column, value));
   else if (compressed)
      CHECK_OK(kschur_problem_set_csr(problem, KSCHUR_STIFFNESS, 3, 3, 7, base, row32, column32, value));
   else if (wide)
      CHECK_OK(kschur_problem_set_triplets64(problem, KSCHUR_STIFFNESS, 3, 3, 7, base, row, column, value));
   else
      CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 3, 3, 7, base, row32, column32, value));
   /* Inputs are copied: what becomes of them does not matter. */
   memset(value, 0, sizeof value);
   free(row);
   free(column);
   free(row32);
   free(column32);
}

static void every_layout_is_the_same_matrix(void)
{
   for (int kind = 0; kind < 8; kind++) {
      kschur_problem *problem = with_mass();
      kschur_options *options = new_options(3);
      kschur_result *result = new_result();
      double frequency[3];

      set_stiffness(problem, kind & 1, kind & 2, kind & 4 ? 1 : 0);
      CHECK_OK(kschur_solve(problem, options, result));
      CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 3));
      for (int j = 0; j < 3; j++) CHECK_NEAR(frequency[j], chain_omega(3, j + 1) / (2 * pi), 1e-14 * 3);
      kschur_problem_destroy(&problem);
      kschur_options_destroy(&options);
      kschur_result_destroy(&result);
   }
}

static void a_matrix_may_be_set_again(void)
{
   kschur_problem *problem = new_chain(3, 0, 0);
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();
   double frequency;
   int64_t n, m;

   CHECK_OK(kschur_solve(problem, options, result));
   set_tridiagonal(problem, KSCHUR_MASS, 3, 4, 0, 0);
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, &frequency, 1));
   CHECK_NEAR(frequency, chain_omega(3, 1) / (4 * pi), 1e-14);

   /* Another size: all that is given must fit again; what is not given does. */
   set_tridiagonal(problem, KSCHUR_MASS, 5, 1, 0, 0);
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(result, result, "the stiffness matrix K is 3 x 3 but must be 5 x 5");
   set_tridiagonal(problem, KSCHUR_STIFFNESS, 5, 200, -100, -100);
   CHECK_OK(kschur_problem_get_size(problem, &n, &m));
   CHECK(n == 5 && m == 0);
   tie(problem, 5, 1, (const int[]){0}, (const int[]){4});
   CHECK_OK(kschur_problem_get_size(problem, &n, &m));
   CHECK(n == 5 && m == 1);

   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void entries_of_one_place_are_summed(void)
{
   const int32_t zero[] = {0, 0}, start[] = {0, 2};
   const double half[] = {150, 250}, mass[] = {1, 3};
   kschur_problem *problem = NULL;
   kschur_options *options = new_options(1);
   kschur_result *result = new_result();
   double frequency;

   CHECK_OK(kschur_problem_create(&problem));
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_MASS, 1, 1, 2, 0, zero, zero, mass));
   CHECK_OK(kschur_problem_set_csr(problem, KSCHUR_STIFFNESS, 1, 1, 2, 0, start, zero, half));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, &frequency, 1));
   CHECK_NEAR(frequency, 10 / (2 * pi), 1e-15);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void wrong_arrays(void)
{
   const int32_t index[] = {0, 1, 2}, start[] = {0, 1, 2, 3}, descending[] = {0, 2, 1, 3}, late[] = {1, 1, 2, 3};
   const int32_t short_start[] = {0, 1, 2, 2}, outside[] = {0, 1, 3}, negative[] = {0, -1, 2}, least[] = {0, INT32_MIN, 2};
   const int64_t huge_index[] = {0, 5000000000, 2}, lowest[] = {0, 1, INT64_MIN};
   const double value[] = {1, 2, 3};
   kschur_problem *problem = new_chain(3, 0, 0);
   int64_t n;

   CHECK_STATUS(kschur_problem_set_csr(problem, 6, 3, 3, 3, 0, start, index, value), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(problem, problem, "no matrix number 6");
   CHECK_STATUS(kschur_problem_set_csr(problem, -1, 3, 3, 3, 0, start, index, value), KSCHUR_ERROR_USAGE);
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 3, 3, 3, 2, start, index, value), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(problem, problem, "the mass matrix M: the index base is 2");
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, -3, 3, 3, 0, start, index, value), KSCHUR_ERROR_INPUT);
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 3, -3, 3, 0, start, index, value), KSCHUR_ERROR_INPUT);
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 3, 3, -3, 0, start, index, value), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "not be 3, 3 and -3");
   for (int k = 0; k < 3; k++) {
      const int64_t most = INT32_MAX;
      CHECK_STATUS(kschur_problem_set_csr64(problem, KSCHUR_MASS, k == 0 ? most : 3, k == 1 ? most : 3, k == 2 ? most : 3, 0,
                                            huge_index, huge_index, value), KSCHUR_ERROR_INPUT);
      CHECK_MESSAGE(problem, problem, "must lie between 0 and 2147483646");
   }
   CHECK_STATUS(kschur_problem_set_csr64(problem, KSCHUR_MASS, INT64_MAX, 3, 3, 0, huge_index, huge_index, value),
                KSCHUR_ERROR_INPUT);
   CHECK_STATUS(kschur_problem_set_triplets(problem, KSCHUR_MASS, 2000000000, 2000000000, 3, 0, index, index, value),
                KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "cannot be meant");

   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_STIFFNESS, 3, 3, 3, 0, descending, index, value), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "the stiffness matrix K: the row starts descend");
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 3, 3, 3, 0, late, index, value), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "do not span");
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 3, 3, 3, 0, short_start, index, value), KSCHUR_ERROR_INPUT);
   /* Indices are named as the caller counts them. */
   CHECK_STATUS(kschur_problem_set_csr(problem, KSCHUR_MASS, 3, 3, 3, 0, start, outside, value), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "column[2] is 3 but must lie between 0 and 2");
   CHECK_STATUS(kschur_problem_set_triplets(problem, KSCHUR_MASS, 3, 3, 3, 1, outside, outside, value), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "row[0] is 0 but must lie between 1 and 3");
   CHECK_STATUS(kschur_problem_set_triplets(problem, KSCHUR_MASS, 3, 3, 3, 0, negative, index, value), KSCHUR_ERROR_INPUT);
   CHECK_STATUS(kschur_problem_set_triplets(problem, KSCHUR_MASS, 3, 3, 3, 1, least, index, value), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "row[0] is 0");
   CHECK_STATUS(kschur_problem_set_triplets64(problem, KSCHUR_MASS, 3, 3, 3, 0, huge_index, huge_index, value),
                KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "row[1] is 5000000000");
   CHECK_STATUS(kschur_problem_set_triplets64(problem, KSCHUR_MASS, 3, 3, 3, 0, lowest, lowest, value), KSCHUR_ERROR_INPUT);

   /* None of these changed the problem. */
   CHECK_OK(kschur_problem_get_size(problem, &n, NULL));
   CHECK(n == 3);
   kschur_problem_destroy(&problem);
}

static void matrices_that_make_no_problem(void)
{
   const int32_t index[] = {0};
   const double not_a_number = NAN, zero = 0;
   kschur_problem *problem = new_chain(3, 0, 0);

   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 3, 3, 1, 0, index, index, &not_a_number));
   CHECK_STATUS(kschur_problem_get_size(problem, NULL, NULL), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "damping matrix R has an entry that is not a finite number");
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 3, 3, 0, 0, NULL, NULL, NULL));
   CHECK_OK(kschur_problem_get_size(problem, NULL, NULL));

   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_CONSTRAINTS, 1, 3, 1, 0, index, index, &zero));
   CHECK_STATUS(kschur_problem_get_size(problem, NULL, NULL), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "row 0 of the constraint Jacobian Cq is empty");
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_CONSTRAINTS, 0, 3, 0, 0, NULL, NULL, NULL));
   CHECK_OK(kschur_problem_get_size(problem, NULL, NULL));

   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_MASS, 3, 3, 0, 0, NULL, NULL, NULL));
   CHECK_STATUS(kschur_problem_get_size(problem, NULL, NULL), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "mass matrix M is zero");
   kschur_problem_destroy(&problem);
}

static void halves_of_symmetric_matrices(void)
{
   kschur_problem *problem = NULL, *copy = NULL;
   kschur_options *options = new_options(2);
   kschur_result *result = new_result();
   double frequency[2];

   CHECK_OK(kschur_problem_create(&problem));
   set_tridiagonal(problem, KSCHUR_MASS, 5, 1, 0, 0);
   set_tridiagonal(problem, KSCHUR_STIFFNESS, 5, 200, -100, 0);
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(result, result, "the stiffness matrix K has entries in its lower triangle only");
   CHECK_STATUS(kschur_problem_set_symmetric(problem, "half"), KSCHUR_ERROR_USAGE);
   CHECK_MESSAGE(problem, problem, "'half', only check, lower, upper, no");
   CHECK_OK(kschur_problem_set_symmetric(problem, "upper"));
   CHECK_STATUS(kschur_problem_get_size(problem, NULL, NULL), KSCHUR_ERROR_INPUT);
   CHECK_MESSAGE(problem, problem, "the entry (1, 0) of the stiffness matrix K must mirror that at (0, 1)");
   CHECK_OK(kschur_problem_set_symmetric(problem, "no"));
   CHECK_OK(kschur_problem_write_hdf5(problem, "capi_half.h5"));
   CHECK_OK(kschur_problem_set_symmetric(problem, "lower"));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 2));
   CHECK_NEAR(frequency[0], chain_omega(5, 1) / (2 * pi), 1e-13);
   CHECK_NEAR(frequency[1], chain_omega(5, 2) / (2 * pi), 1e-13);

   /* What is set afterwards is a half as well; so is what is read. */
   set_tridiagonal(problem, KSCHUR_MASS, 4, 1, 0, 0);
   set_tridiagonal(problem, KSCHUR_STIFFNESS, 4, 200, -100, 0);
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 2));
   CHECK_NEAR(frequency[0], chain_omega(4, 1) / (2 * pi), 1e-13);
   CHECK_OK(kschur_problem_create(&copy));
   CHECK_STATUS(kschur_problem_read_hdf5(copy, "capi_half.h5"), KSCHUR_ERROR_INPUT);
   CHECK_OK(kschur_problem_set_symmetric(copy, "lower"));
   CHECK_OK(kschur_problem_read_hdf5(copy, "capi_half.h5"));
   CHECK_OK(kschur_solve(copy, options, result));
   CHECK_OK(kschur_result_get_frequencies_hz(result, frequency, 2));
   CHECK_NEAR(frequency[0], chain_omega(5, 1) / (2 * pi), 1e-13);

   /* A coupling one way that is no half. */
   CHECK_OK(kschur_problem_set_symmetric(problem, "check"));
   set_tridiagonal(problem, KSCHUR_STIFFNESS, 4, 200, 0, 300);
   CHECK_OK(kschur_problem_get_size(problem, NULL, NULL));

   remove("capi_half.h5");
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&copy);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void files(void)
{
   kschur_problem *problem = new_chain_with_dashpot(6, 3), *copy = NULL;
   kschur_options *options = new_options(4);
   kschur_result *result = new_result();
   double before[8], after[8];
   int64_t n, m;
   FILE *text;

   tie(problem, 6, 1, (const int[]){2}, (const int[]){3});
   CHECK_OK(kschur_problem_write_hdf5(problem, "capi_problem.h5"));
   CHECK_OK(kschur_problem_create(&copy));
   CHECK_OK(kschur_problem_read_hdf5(copy, "capi_problem.h5"));
   CHECK_OK(kschur_problem_get_size(copy, &n, &m));
   CHECK(n == 6 && m == 1);
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, before, 8));
   CHECK_OK(kschur_solve(copy, options, result));
   CHECK_OK(kschur_result_get_eigenvalues(result, after, 8));
   CHECK(memcmp(before, after, sizeof before) == 0);

   CHECK_STATUS(kschur_problem_read_hdf5(copy, "capi_missing.h5"), KSCHUR_ERROR_FILE);
   CHECK_MESSAGE(problem, copy, "capi_missing.h5: no such file");
   text = fopen("capi_text.h5", "w");
   fputs("this is no HDF5\n", text);
   fclose(text);
   CHECK_STATUS(kschur_problem_read_hdf5(copy, "capi_text.h5"), KSCHUR_ERROR_FILE);
   CHECK_MESSAGE(problem, copy, "not an HDF5 file");
   CHECK_STATUS(kschur_problem_write_hdf5(copy, "capi_no_folder/problem.h5"), KSCHUR_ERROR_FILE);
   CHECK_STATUS(kschur_problem_read_hdf5(copy, ""), KSCHUR_ERROR_FILE);
   CHECK_OK(kschur_solve(copy, options, result));

   remove("capi_problem.h5");
   remove("capi_text.h5");
   kschur_problem_destroy(&problem);
   kschur_problem_destroy(&copy);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

int main(void)
{
   every_layout_is_the_same_matrix();
   a_matrix_may_be_set_again();
   entries_of_one_place_are_summed();
   wrong_arrays();
   matrices_that_make_no_problem();
   halves_of_symmetric_matrices();
   files();
   return report_checks();
}
