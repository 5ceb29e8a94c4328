/* One mass on a spring: prints its frequency in Hz, sqrt(400/4)/(2 pi) = 1.591549. */
#include <kschur.h>
#include <stdio.h>

int main(void)
{
   const int32_t index = 0;
   const double mass = 4, stiffness = 400;
   double frequency = 0;
   kschur_problem *problem = NULL;
   kschur_options *options = NULL;
   kschur_result *result = NULL;
   int status;

   kschur_problem_create(&problem);
   kschur_problem_set_triplets(problem, KSCHUR_MASS, 1, 1, 1, 0, &index, &index, &mass);
   kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, 1, 1, 1, 0, &index, &index, &stiffness);
   kschur_options_create(&options);
   kschur_options_set_modes(options, 1);
   kschur_result_create(&result);
   status = kschur_solve(problem, options, result);
   if (status == KSCHUR_OK) status = kschur_result_get_frequencies_hz(result, &frequency, 1);
   printf("%.6f\n", frequency);
   kschur_problem_destroy(&problem);
   kschur_options_destroy(&options);
   kschur_result_destroy(&result);
   return status;
}
