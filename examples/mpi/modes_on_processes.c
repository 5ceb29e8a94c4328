/* A program that has MPI already asks for modes on all of its processes: a chain of unit masses and springs between walls,
 * whose frequencies are 2 sin(i pi/(2 n + 2)) rad/s, of which the first process has the matrices.
 *
 *     mpirun -np 4 c_modes_on_processes [what is wrong: nothing, if it is not given]
 */
#include <kschur.h>
#include <math.h>
#include <mpi.h>
#include <stdio.h>

enum { n = 1000, modes = 3 };

/* Rows and columns from 0. */
static void set_matrices(kschur_problem *problem)
{
   static int32_t row[3*n], column[3*n];
   static double value[3*n], one[n];
   int i, entries = n;

   for (i = 0; i < n; i++) {
      row[i] = column[i] = i;
      one[i] = 1;
      value[i] = 2;
   }
   kschur_problem_set_triplets(problem, KSCHUR_MASS, n, n, n, 0, row, column, one);
   for (i = 0; i + 1 < n; i++) {
      row[entries] = column[entries + 1] = i;
      column[entries] = row[entries + 1] = i + 1;
      value[entries] = value[entries + 1] = -1;
      entries += 2;
   }
   kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, n, n, entries, 0, row, column, value);
}

int main(int argc, char **argv)
{
   const double pi = acos(-1.0);
   kschur_problem *problem = NULL;
   kschur_options *options = NULL;
   kschur_result *result = NULL;
   double frequency[modes];
   char message[500] = "";
   int rank, status, i;

   MPI_Init(&argc, &argv);
   MPI_Comm_rank(MPI_COMM_WORLD, &rank);
   if (rank == 0) {
      kschur_problem_create(&problem);
      if (argc == 1) set_matrices(problem);
   }
   kschur_options_create(&options);
   kschur_options_set_modes(options, modes);
   kschur_options_set_communicator(options, MPI_Comm_c2f(MPI_COMM_WORLD));
   kschur_options_set_distribute(options, 1);
   kschur_result_create(&result);

   /* Every process calls; those but the first give no problem and get no result. */
   status = kschur_solve(problem, options, result);
   if (status != KSCHUR_OK) {
      kschur_result_get_message(result, message, sizeof message);
      printf("process %d: %s\n", rank, message);
   } else if (rank == 0) {
      kschur_result_get_frequencies_hz(result, frequency, modes);
      printf("     rad/s        exact\n");
      for (i = 0; i < modes; i++) printf("%12.9f%12.9f\n", 2*pi*frequency[i], 2*sin((i + 1)*pi/(2*n + 2)));
   }
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
   MPI_Finalize();
   return status;
}
