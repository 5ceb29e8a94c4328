/* kschur.hpp: handles, names, parts, and exceptions out of functions of the caller. */
#include <kschur.hpp>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

using complex = std::complex<double>;
static int failed = 0;
static const double pi = std::acos(-1.0);

#define CHECK(condition) \
   do { \
      if (!(condition)) { \
         std::printf("%s:%d: not true: %s\n", __FILE__, __LINE__, #condition); \
         failed++; \
      } \
   } while (0)

/* That it throws an error of this status, with these words. */
template <typename Function> static bool throws(int status, const std::string &words, Function function)
{
   try {
      function();
   } catch (const kschur::error &error) {
      if (error.status() == status && std::string(error.what()).find(words) != std::string::npos) return true;
      std::printf("status %d: %s\n", error.status(), error.what());
   }
   return false;
}

/* n masses of 1 kg between walls, joined by springs of 1 N/m: omega_j = 2 sin(j pi/(2 n + 2)). */
template <typename Index> static kschur::problem chain(int n, double dashpot = 0)
{
   std::vector<Index> start{0}, column, diagonal;
   std::vector<double> value, ones(n, 1.0);
   for (Index i = 0; i < n; i++) {
      diagonal.push_back(i);
      for (Index j = std::max<Index>(i - 1, 0); j <= std::min<Index>(i + 1, n - 1); j++) {
         column.push_back(j);
         value.push_back(i == j ? 2 : -1);
      }
      start.push_back(static_cast<Index>(column.size()));
   }
   kschur::problem problem;
   problem.set_triplets(KSCHUR_MASS, n, n, diagonal, diagonal, ones).set_csr(KSCHUR_STIFFNESS, n, n, start, column, value);
   if (dashpot > 0)
      problem.set_triplets(KSCHUR_DAMPING, n, n, std::vector<Index>{0}, std::vector<Index>{0}, std::vector<double>{dashpot});
   return problem;
}

static double omega(int n, int j) { return 2 * std::sin(j * pi / (2 * n + 2)); }

static void closed_form()
{
   kschur::options options;
   options.set("modes", 4).set("target", complex(0, 0)).set("tolerance", 1e-11).set("left", false);
   auto problem = chain<std::int64_t>(50);
   CHECK(problem.unknowns() == 50 && problem.constraints() == 0);
   const auto moved = std::move(problem);
   const kschur::result result = kschur::solve(moved, options);
   CHECK(result.modes() == 4 && result.converged() && result.text("formulation") != "");
   const auto hertz = result.numbers("frequency_hz");
   for (int j = 0; j < 4; j++) {
      CHECK(std::abs(hertz[j] - omega(50, j + 1) / (2 * pi)) < 1e-13);
      CHECK(std::abs(result.eigenvalues()[j] - complex(0, omega(50, j + 1))) < 1e-12);
   }
   CHECK(result.is_real(1));
   const auto shape = result.real_shape(1), part = result.real_shape(1, {49, 3});
   CHECK(shape.size() == 50 && part.size() == 2 && part[0] == shape[49] && part[1] == shape[3]);
   CHECK(std::abs(std::abs(shape[3]) - std::sqrt(2.0 / 51) * std::abs(std::sin(8 * pi / 51))) < 1e-12);
   CHECK(result.shape(1)[3] == complex(shape[3], 0) && result.shape(0, {}, "multipliers").empty());
   CHECK(kschur::solve_band(moved, 0, hertz[2] * 1.001).modes() == 3);
}

static void half_of_a_symmetric_matrix()
{
   const std::vector<std::int32_t> unit{0, 1}, row{0, 1, 1}, column{0, 0, 1};
   kschur::problem problem;
   problem.set_triplets(KSCHUR_MASS, 2, 2, unit, unit, {1, 1}).set_triplets(KSCHUR_STIFFNESS, 2, 2, row, column, {2, -1, 2});
   CHECK(throws(KSCHUR_ERROR_INPUT, "lower triangle only", [&] { kschur::solve(problem); }));
   CHECK(throws(KSCHUR_ERROR_USAGE, "'half'", [&] { problem.set_symmetric("half"); }));
   const auto result = kschur::solve(problem.set_symmetric("lower"), kschur::options().set("modes", 2));
   CHECK(std::abs(result.eigenvalues()[1] - complex(0, std::sqrt(3))) < 1e-12);
}

static void errors()
{
   kschur::options options;
   kschur::problem empty;
   CHECK(throws(KSCHUR_ERROR_USAGE, "at least 1", [&] { options.set("modes", 0); }));
   CHECK(throws(KSCHUR_ERROR_USAGE, "no option 'colour'", [&] { options.set("colour", "red"); }));
   CHECK(throws(KSCHUR_ERROR_ORDER, "mass", [&] { kschur::solve(empty); }));
   CHECK(throws(KSCHUR_ERROR_LENGTH, "column for each value",
                [&] { empty.set_triplets(KSCHUR_MASS, 1, 1, std::vector<int>{0}, std::vector<int>{}, {1.0}); }));
   CHECK(throws(KSCHUR_ERROR_INPUT, "column[0] is 7", [&] {
      empty.set_triplets(KSCHUR_MASS, 1, 1, std::vector<int>{0}, std::vector<int>{7}, std::vector<double>{1.0});
   }));
   CHECK(throws(KSCHUR_ERROR_FILE, "nowhere.h5", [&] { kschur::result().read("nowhere.h5"); }));
   const auto result = kschur::solve(chain<int>(20, 1.0));
   CHECK(!result.is_real(0));
   CHECK(throws(KSCHUR_ERROR_USAGE, "not all of these modes are real", [&] { result.real_shape(0); }));
   CHECK(throws(KSCHUR_ERROR_USAGE, "counted from 0", [&] { result.shape(10); }));
   CHECK(throws(KSCHUR_ERROR_ORDER, "left_eigenvectors", [&] { result.shape(0, {}, "left_eigenvectors"); }));
}

struct thrown {};

static void callbacks()
{
   const auto problem = chain<int>(400);
   kschur::options options;
   int calls = 0;
   options.set("modes", 30).set("formulation", "symmetric").set("subspace", 40);
   options.set_progress([&](const kschur::progress &state) { return calls++, state.wanted >= 30; });
   CHECK(kschur::solve(problem, options).converged() && calls > 1);
   options.set_progress([](const kschur::progress &) { return false; });
   CHECK(kschur::solve(problem, options).text("reason") == "cancelled");
   options.set_progress([](const kschur::progress &) { return true; });
   options.set_stop([&] { return calls > 0; });
   CHECK(kschur::solve(problem, options).text("reason") == "cancelled");
   options.set_stop([&] { return false; });
   CHECK(kschur::solve(problem, options).converged());
   options.set_stop([]() -> bool { throw thrown(); });
   bool caught = false;
   const auto moved = std::move(options);
   for (int k = 0; k < 2; k++) {
      try {
         kschur::solve(problem, moved);
      } catch (const thrown &) {
         caught = true;
      }
      CHECK(caught);
      caught = false;
   }
}

/* Tridiagonal elimination without pivoting, which chains allow; the matrices are symmetric. */
template <typename Scalar> class elimination : public kschur::factors<Scalar> {
public:
   static int alive, made;
   static bool broken;

   explicit elimination(const kschur::matrix_view<Scalar> &matrix) : diagonal(matrix.n), upper(matrix.n)
   {
      for (std::int64_t i = 0; i < matrix.n; i++)
         for (auto k = matrix.row_start[i]; k < matrix.row_start[i + 1]; k++) {
            if (matrix.column[k] == i) diagonal[i] = matrix.value[k];
            if (matrix.column[k] == i + 1) upper[i] = matrix.value[k];
         }
      for (std::int64_t i = 1; i < matrix.n; i++) diagonal[i] -= upper[i - 1] * upper[i - 1] / diagonal[i - 1];
      if (diagonal.back() == Scalar(0)) throw kschur::singular();
      alive++, made++;
   }
   ~elimination() override { alive--; }
   void solve(Scalar *x, std::int64_t n, std::int64_t vectors, bool adjoint) override
   {
      if (broken) throw thrown();
      const auto as = [&](Scalar a) { if constexpr (std::is_same_v<Scalar, complex>) return adjoint ? std::conj(a) : a; else return a; };
      for (std::int64_t v = 0; v < vectors; v++, x += n) {
         for (std::int64_t i = 1; i < n; i++) x[i] -= as(upper[i - 1] / diagonal[i - 1]) * x[i - 1];
         x[n - 1] /= as(diagonal[n - 1]);
         for (std::int64_t i = n - 2; i >= 0; i--) x[i] = (x[i] - as(upper[i]) * x[i + 1]) / as(diagonal[i]);
      }
   }

private:
   std::vector<Scalar> diagonal, upper;
};
template <typename Scalar> int elimination<Scalar>::alive = 0;
template <typename Scalar> int elimination<Scalar>::made = 0;
template <typename Scalar> bool elimination<Scalar>::broken = false;

template <typename Scalar> static void own_solver(complex target)
{
   const auto problem = chain<int>(150, 0.5);
   kschur::options theirs, own;
   theirs.set("modes", 5).set("formulation", "quadratic").set("target", target).set("left", true);
   own.set("modes", 5).set("formulation", "quadratic").set("target", target).set("left", true);
   own.set_solver([](const kschur::matrix_view<double> &matrix) { return std::make_unique<elimination<double>>(matrix); });
   own.set_solver([](const kschur::matrix_view<complex> &matrix) { return std::make_unique<elimination<complex>>(matrix); });
   const auto expected = kschur::solve(problem, theirs).eigenvalues();
   const auto result = kschur::solve(problem, own);
   for (std::size_t k = 0; k < expected.size(); k++) CHECK(std::abs(result.eigenvalues()[k] - expected[k]) < 1e-11);
   CHECK(result.text("inner").find("callbacks") == 0);
   CHECK(elimination<Scalar>::made > 0 && elimination<Scalar>::alive == 0);
   elimination<Scalar>::broken = true;
   bool caught = false;
   try {
      kschur::solve(problem, own);
   } catch (const thrown &) {
      caught = true;
   }
   CHECK(caught && elimination<Scalar>::alive == 0);
   elimination<Scalar>::broken = false;
}

static void files_and_nodes()
{
   auto problem = chain<int>(6);
   problem.set_nodes({0, 0, 0, 1, 0, 0}).write("test_cpp.h5");
   kschur::problem read;
   const auto result = kschur::solve(read.read("test_cpp.h5"));
   CHECK(result.numbers("coordinates") == (std::vector<double>{0, 0, 0, 1, 0, 0}));
   CHECK(result.numbers("unknown_component") == (std::vector<double>{0, 1, 2, 0, 1, 2}));
   result.write("test_cpp.h5");
   CHECK(kschur::result().read("test_cpp.h5").eigenvalues() == result.eigenvalues());
   std::remove("test_cpp.h5");
}

int main()
{
   closed_form();
   half_of_a_symmetric_matrix();
   errors();
   callbacks();
   own_solver<double>(0);
   own_solver<complex>(complex(0, 1));
   files_and_nodes();
   if (failed > 0) std::printf("%d checks failed\n", failed);
   return failed > 0;
}
