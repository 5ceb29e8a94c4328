/* Models with closed forms for the tests of the C interface. */
#ifndef MODELS_H
#define MODELS_H

#include "check.h"

static const double pi = 3.14159265358979323846;

/* Angular frequency of mode j = 1, 2, ... of the chain below. */
static inline double chain_omega(int n, int j)
{
   return 20 * sin(j * pi / (2 * (n + 1)));
}

/* Sets a matrix with `diagonal` on its diagonal, `lower` below and `upper` above it. */
static inline void set_tridiagonal(kschur_problem *problem, int matrix, int n, double diagonal, double lower, double upper)
{
   int32_t *row = malloc(3 * n * sizeof *row), *column = malloc(3 * n * sizeof *column);
   double *value = malloc(3 * n * sizeof *value);
   int64_t entries = 0;

   for (int i = 0; i < n; i++)
      for (int j = i - 1; j <= i + 1; j++) {
         double x = j == i ? diagonal : j < i ? lower : upper;
         if (j < 0 || j >= n || x == 0) continue;
         row[entries] = i;
         column[entries] = j;
         value[entries++] = x;
      }
   CHECK_OK(kschur_problem_set_triplets(problem, matrix, n, n, entries, 0, row, column, value));
   free(row);
   free(column);
   free(value);
}

/* n masses of 1 kg between walls, joined by springs of 100 N/m, with damping alpha M + beta K. */
static inline kschur_problem *new_chain(int n, double alpha, double beta)
{
   kschur_problem *problem = NULL;

   CHECK_OK(kschur_problem_create(&problem));
   set_tridiagonal(problem, KSCHUR_MASS, n, 1, 0, 0);
   set_tridiagonal(problem, KSCHUR_STIFFNESS, n, 200, -100, -100);
   if (alpha != 0 || beta != 0)
      set_tridiagonal(problem, KSCHUR_DAMPING, n, alpha + 200 * beta, -100 * beta, -100 * beta);
   return problem;
}

/* The chain with a dashpot of c N s/m at its first mass, which makes its damping general. */
static inline kschur_problem *new_chain_with_dashpot(int n, double c)
{
   const int32_t first = 0;
   kschur_problem *problem = new_chain(n, 0, 0);

   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_DAMPING, n, n, 1, 0, &first, &first, &c));
   return problem;
}

/* Adds constraints number by number: unknowns `first` and `second` move alike. */
static inline void tie(kschur_problem *problem, int n, int constraints, const int *first, const int *second)
{
   int32_t row[20], column[20];
   double value[20];

   for (int i = 0; i < constraints; i++) {
      row[2 * i] = row[2 * i + 1] = i;
      column[2 * i] = first[i];
      column[2 * i + 1] = second[i];
      value[2 * i] = 1;
      value[2 * i + 1] = -1;
   }
   CHECK_OK(kschur_problem_set_triplets(problem, KSCHUR_CONSTRAINTS, constraints, n, 2 * constraints, 0, row, column, value));
}

static inline kschur_options *new_options(int modes)
{
   kschur_options *options = NULL;

   CHECK_OK(kschur_options_create(&options));
   CHECK_OK(kschur_options_set_modes(options, modes));
   return options;
}

static inline kschur_result *new_result(void)
{
   kschur_result *result = NULL;

   CHECK_OK(kschur_result_create(&result));
   return result;
}

#endif
