// One mass on a spring with handles that end themselves: prints its frequency in Hz, 1.591549, and its eigenvalue.
#include <complex>
#include <cstdio>
#include <kschur.h>
#include <memory>
#include <stdexcept>

struct destroy {
   void operator()(kschur_problem *problem) const { kschur_problem_destroy(&problem); }
   void operator()(kschur_options *options) const { kschur_options_destroy(&options); }
   void operator()(kschur_result *result) const { kschur_result_destroy(&result); }
};

template <typename Handle> std::unique_ptr<Handle, destroy> made(int (*create)(Handle **))
{
   Handle *handle = nullptr;
   if (create(&handle) != KSCHUR_OK) throw std::runtime_error("no memory");
   return std::unique_ptr<Handle, destroy>(handle);
}

int main()
{
   const std::int64_t index = 1;
   const double mass = 4, stiffness = 400;
   double frequency = 0;
   std::complex<double> eigenvalue;
   auto problem = made(kschur_problem_create);
   auto options = made(kschur_options_create);
   auto result = made(kschur_result_create);

   kschur_problem_set_triplets64(problem.get(), KSCHUR_MASS, 1, 1, 1, 1, &index, &index, &mass);
   kschur_problem_set_triplets64(problem.get(), KSCHUR_STIFFNESS, 1, 1, 1, 1, &index, &index, &stiffness);
   kschur_options_set_modes(options.get(), 1);
   if (kschur_solve(problem.get(), options.get(), result.get()) != KSCHUR_OK) return 1;
   kschur_result_get_frequencies_hz(result.get(), &frequency, 1);
   kschur_result_get_eigenvalues(result.get(), reinterpret_cast<double *>(&eigenvalue), 2);
   std::printf("%.6f %.6f\n", frequency, eigenvalue.imag());
}
