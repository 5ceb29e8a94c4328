/* Many solves in one process, those that succeed in each formulation and those that fail: the same bits each time, no more
 * memory, no more open files. test_longevity [ROUNDS]; a round is 13 solves. */
#include <complex.h>
#include <dirent.h>
#include <malloc.h>
#include <unistd.h>

#include "models.h"

enum { n = 40, modes = 4, most_solves = 20, warm = 3, few_bytes = 100000 };

/* What a solve found in the first round. */
static double first_values[most_solves][2 * modes], first_vectors[most_solves][2 * n * modes];

static int open_files(void)
{
   DIR *folder = opendir("/proc/self/fd");
   int count = 0;

   if (folder == NULL) return 0;
   while (readdir(folder) != NULL) count++;
   closedir(folder);
   return count;
}

/* In use, by malloc and by pages of its own. What malloc keeps at hand for sizes it has seen counts too, and settles slowly. */
static size_t bytes_in_use(void)
{
   struct mallinfo2 all = mallinfo2();

   return all.uordblks + all.hblkhd;
}

static void expect_same_bits(int solve, int is_first, kschur_result *result)
{
   double values[2 * modes], vectors[2 * n * modes];

   CHECK_OK(kschur_result_get_eigenvalues(result, values, 2 * modes));
   CHECK_OK(kschur_result_get_eigenvectors(result, vectors, 2 * n * modes));
   if (is_first) {
      memcpy(first_values[solve], values, sizeof values);
      memcpy(first_vectors[solve], vectors, sizeof vectors);
   }
   CHECK(memcmp(first_values[solve], values, sizeof values) == 0);
   CHECK(memcmp(first_vectors[solve], vectors, sizeof vectors) == 0);
}

static void solve_each_formulation(int is_first)
{
   static const struct { double alpha, dashpot; int tied; const char *formulation, *inner; } cases[] = {
      {0, 0, 0, "symmetric", "auto"}, {0, 0, 1, "symmetric", "mumps"}, {0.1, 0, 1, "proportional", "ldl"},
      {0.1, 0, 0, "quadratic", "mumps"}, {0, 3, 1, "quadratic", "iterative"}, {0, 3, 0, "low-rank", "auto"},
      {0, 3, 1, "dense", "auto"}, {0, 0, 0, "undamped", "mumps"}, {0, 0, 1, "undamped-constrained", "mumps"},
      {0, 3, 0, "damped", "mumps"}, {0, 3, 1, "damped-constrained", "mumps"}};
   static const int left[] = {0}, right[] = {n - 1};

   for (int i = 0; i < (int)(sizeof cases / sizeof *cases); i++) {
      kschur_problem *problem = cases[i].dashpot != 0 ? new_chain_with_dashpot(n, cases[i].dashpot) : new_chain(n, cases[i].alpha, 0);
      kschur_options *options = new_options(modes);
      kschur_result *result = new_result();

      if (cases[i].tied) tie(problem, n, 1, left, right);
      CHECK_OK(kschur_options_set_formulation(options, cases[i].formulation));
      CHECK_OK(kschur_options_set_inner(options, cases[i].inner));
      CHECK_OK(kschur_solve(problem, options, result));
      CHECK_MESSAGE(result, result, "");
      expect_same_bits(i, is_first, result);
      kschur_problem_destroy(&problem);
      kschur_options_destroy(&options);
      kschur_result_destroy(&result);
   }
}

static void fail_in_each_way(void)
{
   const char *path = "test_longevity.h5";
   const int32_t place = 0;
   const double not_a_number = NAN;
   kschur_problem *problem = new_chain_with_dashpot(n, 3);
   kschur_options *options = new_options(modes);
   kschur_result *result = new_result();

   CHECK_OK(kschur_options_set_formulation(options, "symmetric"));
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_USAGE);
   CHECK_OK(kschur_options_set_formulation(options, "damped"));
   CHECK_OK(kschur_options_set_max_restarts(options, 1));
   CHECK_OK(kschur_options_set_subspace(options, 8));
   CHECK_OK(kschur_solve(problem, options, result));
   CHECK_OK(kschur_result_write_hdf5(result, path));
   CHECK_OK(kschur_result_read_hdf5(result, path));
   CHECK_STATUS(kschur_problem_read_hdf5(problem, path), KSCHUR_ERROR_INPUT);
   /* Not within: HDF5 1.10 keeps a file open whose first object it cannot read. */
   CHECK(truncate(path, 1000) == 0);
   CHECK(kschur_result_read_hdf5(result, path) != KSCHUR_OK);
   remove(path);
   CHECK_STATUS(kschur_result_read_hdf5(result, path), KSCHUR_ERROR_FILE);
   CHECK_STATUS(kschur_result_write_hdf5(result, "no/folder/result.h5"), KSCHUR_ERROR_FILE);
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, n, n, 1, 0, &place, &place, &not_a_number));
   CHECK_STATUS(kschur_solve(problem, options, result), KSCHUR_ERROR_INPUT);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

int main(int count, char **words)
{
   const int rounds = count > 1 ? atoi(words[1]) : 15;
   size_t bytes = 0;
   int files = 0;

   for (int round = 0; round < rounds && checks_failed == 0; round++) {
      solve_each_formulation(round == 0);
      fail_in_each_way();
      if (round == warm - 1) {
         bytes = bytes_in_use();
         files = open_files();
      }
   }
   printf("%d rounds: %zu bytes and %d files after %d, %zu and %d at the end\n", rounds, bytes, files, warm, bytes_in_use(),
      open_files());
   CHECK(rounds > warm);
   CHECK(bytes_in_use() <= bytes + few_bytes);
   CHECK(open_files() == files);
   return report_checks();
}
