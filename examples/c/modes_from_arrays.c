/* The shortest way from arrays to modes: two masses between walls, tied together by a constraint, with a dashpot on the
 * first.
 *
 * Closed form: the pair moves as one mass of 2 kg on a spring of 200 N/m with a dashpot of 4 N s/m:
 * omega = 10 rad/s, damping ratio 4/(2 2 10) = 0.1. */
#include <kschur.h>
#include <stdio.h>

int main(void)
{
   const int32_t diagonal[] = {0, 1}, first[] = {0}, row_of_tie[] = {0, 0};
   const double masses[] = {1, 1}, springs[] = {100, 100}, dashpot[] = {4}, tie[] = {1, -1};
   kschur_problem *problem = NULL;
   kschur_options *options = NULL;
   kschur_result *result = NULL;
   double frequency, damping_ratio;
   char message[500] = "";
   int status;

   kschur_problem_create(&problem);
   kschur_problem_set_triplets(problem, KSCHUR_MASS, 2, 2, 2, 0, diagonal, diagonal, masses);
   kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 2, 2, 2, 0, diagonal, diagonal, springs);
   kschur_problem_set_triplets(problem, KSCHUR_DAMPING, 2, 2, 1, 0, first, first, dashpot);
   kschur_problem_set_triplets(problem, KSCHUR_CONSTRAINTS, 1, 2, 2, 0, row_of_tie, diagonal, tie);
   kschur_options_create(&options);
   kschur_options_set_modes(options, 1);
   kschur_result_create(&result);

   status = kschur_solve(problem, options, result);
   if (status == KSCHUR_OK) status = kschur_result_get_frequencies_hz(result, &frequency, 1);
   if (status == KSCHUR_OK) status = kschur_result_get_damping_ratios(result, &damping_ratio, 1);
   if (status == KSCHUR_OK) {
      printf("frequency %9.6f Hz, damping ratio %9.6f\n", frequency, damping_ratio);
   } else {
      kschur_result_get_message(result, message, sizeof message);
      printf("%s\n", message);
   }
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
   return status;
}
