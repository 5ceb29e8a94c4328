/* Threads that solve different problems at the same time, and threads that share one: bitwise the results of serial
 * runs. The problems go through every library below: ARPACK, LDL, real and complex MUMPS with METIS, LAPACK, HDF5. */
#include <pthread.h>

#include "models.h"

enum { problems = 6, threads = 4, rounds = 4, modes = 4, side = 25, most_unknowns = side * side };

/* What a solve gives, to be compared bit by bit. */
typedef struct {
   double eigenvalues[2 * modes], eigenvectors[2 * modes * most_unknowns];
   int64_t found;
   char inner[200];
} answer;

static answer serial[problems];
static kschur_problem *shared_problem;
static kschur_options *shared_options;
static pthread_barrier_t start_of_round;

/* Masses on a square, joined to their neighbours, and a little more to those on the left. */
static kschur_problem *new_membrane(void)
{
   const int step[] = {0, -side, side, -1, 1};
   int32_t row[5 * most_unknowns], column[5 * most_unknowns];
   double value[5 * most_unknowns];
   int64_t entries = 0;
   kschur_problem *problem = new_chain_with_dashpot(most_unknowns, 2);

   for (int i = 0; i < most_unknowns; i++)
      for (int k = 0; k < 5; k++) {
         int j = i + step[k], neighbours = j >= 0 && j < most_unknowns && (k < 3 || i / side == j / side);
         if (!neighbours) continue;
         row[entries] = i;
         column[entries] = j;
         value[entries++] = k == 0 ? 400 + 0.01 * i : k == 3 ? -101 : -100;
      }
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, most_unknowns, most_unknowns, entries, 0, row, column, value));
   return problem;
}

static kschur_problem *new_problem(int which)
{
   const int first[] = {10, 20, 30}, second[] = {50, 61, 72};
   kschur_problem *problem;

   switch (which) {
   case 0: /* definite: LDL, Lanczos */
      return new_chain(150, 0.01, 0.001);
   case 1: /* ties that are eliminated, general damping: real quadratic form, left vectors */
      problem = new_chain_with_dashpot(120, 5);
      tie(problem, 120, 3, first, second);
      return problem;
   case 2: /* unsymmetric and so large that METIS draws random numbers: MUMPS */
      return new_membrane();
   case 3: /* multipliers in the factored matrix: real MUMPS, symmetric indefinite */
      problem = new_chain(100, 0, 0);
      tie(problem, 100, 3, first, second);
      return problem;
   case 4: /* complex shift: complex MUMPS */
      return new_chain_with_dashpot(140, 1);
   default: /* ARPACK */
      return new_chain_with_dashpot(80, 3);
   }
}

static kschur_options *new_options_of(int which)
{
   kschur_options *options = new_options(modes);

   if (which == 1) CHECK_OK(kschur_options_set_left(options, 1));
   if (which == 3) CHECK_OK(kschur_options_set_presolve(options, 0));
   if (which == 3) CHECK_OK(kschur_options_set_inner(options, "mumps"));
   if (which == 4) CHECK_OK(kschur_options_set_target(options, -0.01, 5));
   if (which == 5) CHECK_OK(kschur_options_set_method(options, "arpack"));
   return options;
}

static void take_answer(kschur_result *result, answer *got)
{
   memset(got, 0, sizeof *got);
   CHECK_OK(kschur_result_get_modes(result, &got->found, NULL));
   CHECK_OK(kschur_result_get_eigenvalues(result, got->eigenvalues, 2 * modes));
   CHECK_OK(kschur_result_get_eigenvectors(result, got->eigenvectors, 2 * modes * most_unknowns));
   CHECK_OK(kschur_result_get_inner(result, got->inner, sizeof got->inner));
}

static void check_same(int which, const answer *got)
{
   if (memcmp(got, &serial[which], sizeof *got) != 0) printf("problem %d differs from its serial run\n", which);
   CHECK(memcmp(got, &serial[which], sizeof *got) == 0);
}

/* Makes, solves and ends a problem; with a file in between where a path is given. */
static void solve_one(int which, const char *path, answer *got)
{
   kschur_problem *problem = new_problem(which);
   kschur_options *options = new_options_of(which);
   kschur_result *result = new_result();

   if (path) {
      CHECK_OK(kschur_problem_write_hdf5(problem, path));
      CHECK_OK(kschur_problem_read_hdf5(problem, path));
   }
   CHECK_OK(kschur_solve(problem, options, result));
   if (path) {
      CHECK_OK(kschur_result_write_hdf5(result, path));
      CHECK_OK(kschur_result_read_hdf5(result, path));
      remove(path);
   }
   take_answer(result, got);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
}

static void *solve_many(void *argument)
{
   int me = *(int *)argument;
   answer *got = malloc(sizeof *got);
   kschur_problem *bad = NULL;
   kschur_result *result = new_result();
   char path[40], text[200];

   snprintf(path, sizeof path, "capi_thread_%d.h5", me);
   CHECK_OK(kschur_problem_create(&bad));
   for (int round = 0; round < rounds; round++) {
      /* Pairs of threads solve the same problem, and begin together. */
      int which = (me / 2 + round) % problems;
      pthread_barrier_wait(&start_of_round);
      solve_one(which, round % 2 == 0 ? path : NULL, got);
      check_same(which, got);
      CHECK_OK(kschur_solve(shared_problem, shared_options, result));
      take_answer(result, got);
      check_same(1, got);
      /* Messages are made at the same time, too. */
      CHECK_STATUS(kschur_problem_set_triplets(bad, KSCHUR_MASS, -(me + 1), 1, 1, 0, NULL, NULL, NULL), KSCHUR_ERROR_INPUT);
      kschur_problem_get_message(bad, text, sizeof text);
      snprintf(path, sizeof path, "not be -%d, 1 and 1", me + 1);
      CHECK(strstr(text, path) != NULL);
      snprintf(path, sizeof path, "capi_thread_%d.h5", me);
   }
   kschur_problem_destroy(&bad);
   kschur_result_destroy(&result);
   free(got);
   return NULL;
}

int main(void)
{
   pthread_t thread[threads];
   int number[threads];

   for (int i = 0; i < problems; i++) solve_one(i, NULL, &serial[i]);
   for (int i = 0; i < problems; i++) CHECK(serial[i].found == modes);
   CHECK(strncmp(serial[0].inner, "ldl", 3) == 0 && strncmp(serial[3].inner, "mumps", 5) == 0);

   shared_problem = new_problem(1);
   shared_options = new_options_of(1);
   CHECK(pthread_barrier_init(&start_of_round, NULL, threads) == 0);
   for (int i = 0; i < threads; i++) {
      number[i] = i;
      CHECK(pthread_create(&thread[i], NULL, solve_many, &number[i]) == 0);
   }
   for (int i = 0; i < threads; i++) pthread_join(thread[i], NULL);
   pthread_barrier_destroy(&start_of_round);
   kschur_problem_destroy(&shared_problem);
   kschur_options_destroy(&shared_options);
   return report_checks();
}
