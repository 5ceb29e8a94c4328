/*
 * kschur for C++17: the handles of kschur.h end themselves, failures are exceptions, arrays are vectors.
 *
 *     kschur::problem problem;
 *     problem.set_csr(KSCHUR_MASS, n, n, row_start, column, value);          // likewise KSCHUR_STIFFNESS, ...
 *     kschur::options options;
 *     options.set("modes", 12).set("target_hz", 50);
 *     const kschur::result result = kschur::solve(problem, options);
 *     for (double hertz : result.numbers("frequency_hz")) std::cout << hertz << '\n';
 *
 * Names are those of kschur_options_set and kschur_result_get_numbers. A handle may be moved, not copied. Exceptions in
 * functions of the caller end the solve and come out of it; they never pass through the library.
 */
#ifndef KSCHUR_HPP
#define KSCHUR_HPP

#include <kschur.h>

#include <algorithm>
#include <complex>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace kschur {

/* A failure: a sentence, and one of KSCHUR_ERROR_*. */
class error : public std::runtime_error {
public:
   error(int status, const std::string &message) : std::runtime_error(message), status_(status) {}
   int status() const noexcept { return status_; }

private:
   int status_;
};

namespace detail {

template <typename Get> std::string text_of(Get get)
{
   std::string text(256, '\0');
   while (get(text.data(), static_cast<std::int64_t>(text.size())) == KSCHUR_ERROR_LENGTH && text.size() < 1u << 24)
      text.resize(4 * text.size());
   text.resize(text.find('\0'));
   return text;
}

template <typename Handle> using function_on = int (*)(Handle **);
template <typename Handle> using message_of = int (*)(const Handle *, char *, std::int64_t);

/* What owns a handle. */
template <typename Handle, function_on<Handle> create, function_on<Handle> destroy, message_of<Handle> message> class owner {
public:
   owner()
   {
      Handle *made = nullptr;
      if (const int status = create(&made); status != KSCHUR_OK) throw error(status, "there is not enough memory");
      handle_.reset(made);
   }
   /* For functions of kschur.h that are not here. */
   Handle *get() const noexcept { return handle_.get(); }

protected:
   void check(int status) const
   {
      if (status == KSCHUR_OK) return;
      const Handle *handle = get();
      throw error(status, text_of([=](char *text, std::int64_t length) { return message(handle, text, length); }));
   }

private:
   struct end {
      void operator()(Handle *handle) const { destroy(&handle); }
   };
   std::unique_ptr<Handle, end> handle_;
};

inline std::int64_t length(std::size_t size) { return static_cast<std::int64_t>(size); }

/* The shortest of a few notations that reads back as the same number. */
inline std::string text_of(double number)
{
   char text[40];
   std::snprintf(text, sizeof text, "%.17g", number);
   return text;
}

/* The first exception of functions of the caller. */
class keeper {
public:
   void keep(std::exception_ptr raised)
   {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!raised_) raised_ = raised;
   }
   void raise()
   {
      if (raised_) std::rethrow_exception(std::exchange(raised_, nullptr));
   }

private:
   std::mutex mutex_;
   std::exception_ptr raised_;
};

} // namespace detail

/* The four matrices, and where they stand. */
class problem
   : public detail::owner<kschur_problem, kschur_problem_create, kschur_problem_destroy, kschur_problem_get_message> {
public:
   /* Compressed rows; Index is std::int32_t or std::int64_t. */
   template <typename Index>
   problem &set_csr(kschur_matrix matrix, std::int64_t rows, std::int64_t columns, const std::vector<Index> &row_start,
                    const std::vector<Index> &column, const std::vector<double> &value, int index_base = 0)
   {
      if (detail::length(row_start.size()) != rows + 1 || column.size() != value.size())
         throw error(KSCHUR_ERROR_LENGTH, "a matrix needs a row start more than rows, and a column for each value");
      if constexpr (std::is_same_v<Index, std::int64_t>)
         check(kschur_problem_set_csr64(get(), matrix, rows, columns, detail::length(value.size()), index_base,
                                        row_start.data(), column.data(), value.data()));
      else
         check(kschur_problem_set_csr(get(), matrix, rows, columns, detail::length(value.size()), index_base,
                                      row_start.data(), column.data(), value.data()));
      return *this;
   }

   /* Triplets in any order; values of the same place are summed. */
   template <typename Index>
   problem &set_triplets(kschur_matrix matrix, std::int64_t rows, std::int64_t columns, const std::vector<Index> &row,
                         const std::vector<Index> &column, const std::vector<double> &value, int index_base = 0)
   {
      if (row.size() != value.size() || column.size() != value.size())
         throw error(KSCHUR_ERROR_LENGTH, "a matrix needs a row and a column for each value");
      if constexpr (std::is_same_v<Index, std::int64_t>)
         check(kschur_problem_set_triplets64(get(), matrix, rows, columns, detail::length(value.size()), index_base, row.data(),
                                             column.data(), value.data()));
      else
         check(kschur_problem_set_triplets(get(), matrix, rows, columns, detail::length(value.size()), index_base, row.data(),
                                           column.data(), value.data()));
      return *this;
   }

   /* "lower", "upper": M, R and K are given by this half of symmetric matrices; "no": as they are. */
   problem &set_symmetric(const std::string &name)
   {
      check(kschur_problem_set_symmetric(get(), name.c_str()));
      return *this;
   }

   /* Three coordinates of each node; `node` and `component` of each unknown, or both empty. */
   problem &set_nodes(const std::vector<double> &coordinates, const std::vector<std::int32_t> &node = {},
                      const std::vector<std::int32_t> &component = {}, int index_base = 0)
   {
      if (coordinates.size() % 3 != 0 || node.size() != component.size())
         throw error(KSCHUR_ERROR_LENGTH, "nodes have three coordinates each, unknowns a node and a component");
      check(kschur_problem_set_nodes(get(), detail::length(coordinates.size() / 3), coordinates.data(),
                                     detail::length(node.size()), index_base, node.empty() ? nullptr : node.data(),
                                     component.empty() ? nullptr : component.data()));
      return *this;
   }

   std::int64_t unknowns() const { return size().first; }
   std::int64_t constraints() const { return size().second; }
   problem &read(const std::string &path)
   {
      check(kschur_problem_read_hdf5(get(), path.c_str()));
      return *this;
   }
   void write(const std::string &path) const { check(kschur_problem_write_hdf5(get(), path.c_str())); }

private:
   std::pair<std::int64_t, std::int64_t> size() const
   {
      std::pair<std::int64_t, std::int64_t> found;
      check(kschur_problem_get_size(get(), &found.first, &found.second));
      return found;
   }
};

/* Told each time that convergence was looked at. */
struct progress {
   std::int64_t restart, converged, wanted;
   double residual;
};

/* A sparse matrix to be factored, in compressed rows from 0, which lives as long as the call. */
template <typename Scalar> struct matrix_view {
   std::int64_t n, entries;
   const std::int32_t *row_start, *column;
   const Scalar *value;
   bool symmetric;
};

/* The factors of a matrix, by a linear solver of the caller. */
template <typename Scalar> class factors {
public:
   virtual ~factors() = default;
   /* x := A^-1 x for `vectors` columns of length n; with `adjoint` A^-H x. */
   virtual void solve(Scalar *x, std::int64_t n, std::int64_t vectors, bool adjoint) = 0;
};

/* To be thrown where a matrix is singular: another shift is tried then. */
class singular : public error {
public:
   singular() : error(KSCHUR_ERROR_SINGULAR, "the matrix to be factored is singular") {}
};

/* What to compute and how. */
class options
   : public detail::owner<kschur_options, kschur_options_create, kschur_options_destroy, kschur_options_get_message> {
public:
   /* By name, as kschur_options_set. */
   options &set(const std::string &name, const std::string &value)
   {
      check(kschur_options_set(get(), name.c_str(), value.c_str()));
      return *this;
   }
   options &set(const std::string &name, const char *value) { return set(name, std::string(value)); }
   options &set(const std::string &name, std::complex<double> value)
   {
      return set(name, detail::text_of(value.real()) + "," + detail::text_of(value.imag()));
   }
   template <typename Number, std::enable_if_t<std::is_arithmetic_v<Number>, int> = 0>
   options &set(const std::string &name, Number value)
   {
      if constexpr (std::is_same_v<Number, bool>)
         return set(name, value ? "on" : "off");
      else if constexpr (std::is_integral_v<Number>)
         return set(name, std::to_string(value));
      else
         return set(name, detail::text_of(value));
   }

   /* A function that returns whether to go on. */
   options &set_progress(std::function<bool(const progress &)> report)
   {
      calls_->report = std::move(report);
      check(kschur_options_set_progress(get(), &calls::progress_callback, calls_.get()));
      return *this;
   }

   /* A function that is asked before each step whether to end there. */
   options &set_stop(std::function<bool()> stop)
   {
      calls_->stop = std::move(stop);
      check(kschur_options_set_stop(get(), &calls::stop_callback, calls_.get()));
      return *this;
   }

   /* Linear solvers of the caller for real and for complex matrices. */
   options &set_solver(std::function<std::unique_ptr<factors<double>>(const matrix_view<double> &)> factorize)
   {
      calls_->real = std::move(factorize);
      check(kschur_options_set_real_solver(get(), &calls::factorize<double>, &calls::solve<double>, &calls::release<double>,
                                           calls_.get()));
      return *this;
   }
   options &
   set_solver(std::function<std::unique_ptr<factors<std::complex<double>>>(const matrix_view<std::complex<double>> &)> factorize)
   {
      using scalar = std::complex<double>;
      calls_->complex = std::move(factorize);
      check(kschur_options_set_complex_solver(get(), &calls::factorize<scalar>, &calls::solve<scalar>, &calls::release<scalar>,
                                              calls_.get()));
      return *this;
   }

private:
   friend class result;
   template <typename Scalar> using factorizer = std::function<std::unique_ptr<factors<Scalar>>(const matrix_view<Scalar> &)>;

   /* What the library calls, and what was thrown there. */
   struct calls {
      std::function<bool(const progress &)> report;
      std::function<bool()> stop;
      factorizer<double> real;
      factorizer<std::complex<double>> complex;
      detail::keeper raised;

      template <typename Function> int guarded(Function function) noexcept
      {
         try {
            return function();
         } catch (const singular &) {
            return KSCHUR_ERROR_SINGULAR;
         } catch (...) {
            raised.keep(std::current_exception());
            return KSCHUR_ERROR_CALLBACK;
         }
      }
      static int progress_callback(void *context, std::int64_t restart, std::int64_t converged, std::int64_t wanted,
                                   double residual)
      {
         auto self = static_cast<calls *>(context);
         return self->guarded([&] { return self->report && !self->report({restart, converged, wanted, residual}) ? 1 : 0; });
      }
      static int stop_callback(void *context)
      {
         auto self = static_cast<calls *>(context);
         return self->guarded([&] { return self->stop && self->stop() ? 1 : 0; });
      }
      template <typename Scalar>
      static int factorize(void *context, std::int64_t n, std::int64_t entries, const std::int32_t *row_start,
                           const std::int32_t *column, const double *value, int symmetric, void **made)
      {
         auto self = static_cast<calls *>(context);
         return self->guarded([&] {
            const matrix_view<Scalar> matrix{n, entries, row_start, column, reinterpret_cast<const Scalar *>(value),
                                             symmetric != 0};
            if constexpr (std::is_same_v<Scalar, double>)
               *made = self->real(matrix).release();
            else
               *made = self->complex(matrix).release();
            return *made == nullptr ? KSCHUR_ERROR_CALLBACK : KSCHUR_OK;
         });
      }
      template <typename Scalar>
      static int solve(void *context, void *made, int adjoint, std::int64_t n, std::int64_t vectors, double *x)
      {
         return static_cast<calls *>(context)->guarded([&] {
            static_cast<factors<Scalar> *>(made)->solve(reinterpret_cast<Scalar *>(x), n, vectors, adjoint != 0);
            return KSCHUR_OK;
         });
      }
      template <typename Scalar> static void release(void *, void *made) { delete static_cast<factors<Scalar> *>(made); }
   };
   /* Its place stays the same when the options move. */
   std::unique_ptr<calls> calls_ = std::make_unique<calls>();
};

/* The modes of a problem, or of a file. */
class result
   : public detail::owner<kschur_result, kschur_result_create, kschur_result_destroy, kschur_result_get_message> {
public:
   result() = default;
   result(const problem &given, const options &wanted)
   {
      finish(kschur_solve(given.get(), wanted.get(), get()), wanted);
   }
   result(const problem &given, double first_hz, double last_hz, const options &wanted)
   {
      finish(kschur_solve_band(given.get(), first_hz, last_hz, wanted.get(), get()), wanted);
   }

   /* By name, as kschur_result_get_numbers. */
   std::vector<double> numbers(const std::string &name) const
   {
      std::int64_t length = 0;
      check(kschur_result_get_length(get(), name.c_str(), &length));
      std::vector<double> values(static_cast<std::size_t>(length));
      check(kschur_result_get_numbers(get(), name.c_str(), values.data(), length));
      return values;
   }
   double number(const std::string &name) const
   {
      double value = 0;
      check(kschur_result_get_numbers(get(), name.c_str(), &value, 1));
      return value;
   }
   std::string text(const std::string &name) const
   {
      return detail::text_of([&](char *text, std::int64_t length) {
         const int status = kschur_result_get_text(get(), name.c_str(), text, length);
         if (status != KSCHUR_ERROR_LENGTH) check(status);
         return status;
      });
   }
   std::int64_t modes() const { return static_cast<std::int64_t>(number("modes")); }
   bool converged() const { return text("reason") == "converged"; }
   std::vector<std::complex<double>> eigenvalues() const
   {
      std::vector<std::complex<double>> values(static_cast<std::size_t>(modes()));
      check(kschur_result_get_eigenvalues(get(), reinterpret_cast<double *>(values.data()), 2 * detail::length(values.size())));
      return values;
   }

   /* The vector of a mode, counted from 0, at some rows of it or at all; `name` as in kschur_result_get_part. */
   std::vector<std::complex<double>> shape(std::int64_t mode, const std::vector<std::int64_t> &rows = {},
                                           const std::string &name = "eigenvectors") const
   {
      std::vector<std::complex<double>> values(rows_of(name, rows));
      take_part(name, mode, rows, false, reinterpret_cast<double *>(values.data()), 2 * values.size());
      return values;
   }
   bool is_real(std::int64_t mode, const std::string &name = "eigenvectors") const
   {
      int real = 0;
      check(kschur_result_is_real(get(), name.c_str(), mode, &real));
      return real != 0;
   }
   std::vector<double> real_shape(std::int64_t mode, const std::vector<std::int64_t> &rows = {},
                                  const std::string &name = "eigenvectors") const
   {
      std::vector<double> values(rows_of(name, rows));
      take_part(name, mode, rows, true, values.data(), values.size());
      return values;
   }

   result &read(const std::string &path)
   {
      check(kschur_result_read_hdf5(get(), path.c_str()));
      return *this;
   }
   void write(const std::string &path) const { check(kschur_result_write_hdf5(get(), path.c_str())); }

private:
   void finish(int status, const options &wanted) const
   {
      wanted.calls_->raised.raise();
      check(status);
   }
   std::size_t rows_of(const std::string &name, const std::vector<std::int64_t> &rows) const
   {
      if (!rows.empty()) return rows.size();
      return static_cast<std::size_t>(number(name.find("multipliers") == std::string::npos ? "n" : "m"));
   }
   void take_part(const std::string &name, std::int64_t mode, const std::vector<std::int64_t> &rows, bool real, double *values,
                  std::size_t length) const
   {
      kschur_part part = {};
      part.first = mode;
      part.count = 1;
      part.rows = rows.empty() ? nullptr : rows.data();
      part.row_count = detail::length(rows.size());
      part.real = real;
      check(kschur_result_get_part(get(), name.c_str(), &part, values, detail::length(length)));
   }
};

/* The modes nearest to the target. */
inline result solve(const problem &given, const options &wanted = {}) { return result(given, wanted); }

/* All modes of a band of natural frequencies (Hz). */
inline result solve_band(const problem &given, double first_hz, double last_hz, const options &wanted = {})
{
   return result(given, first_hz, last_hz, wanted);
}

} // namespace kschur

#endif
