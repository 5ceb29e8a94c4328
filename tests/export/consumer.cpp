// One mass on a spring: prints its frequency in Hz, 1.591549, and its eigenvalue.
#include <cstdint>
#include <cstdio>
#include <kschur.hpp>

int main()
{
   using indices = std::vector<std::int64_t>;
   kschur::problem problem;
   problem.set_triplets(KSCHUR_MASS, 1, 1, indices{1}, indices{1}, {4.0}, 1);
   problem.set_triplets(KSCHUR_STIFFNESS, 1, 1, indices{1}, indices{1}, {400.0}, 1);
   const auto result = kschur::solve(problem, kschur::options().set("modes", 1));
   std::printf("%.6f %.6f\n", result.numbers("frequency_hz").front(), result.eigenvalues().front().imag());
}
