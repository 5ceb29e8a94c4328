/*
 * kschur: modes of damped, constrained, possibly unsymmetric structures, for C and C++.
 *
 *     (lambda^2 M + lambda R + K) phi + Cq^T xi = 0,    Cq phi = 0
 *
 * Mass M, damping R and stiffness K are n x n, the constraint Jacobian Cq is m x n; all are sparse and real. From
 * arrays to frequencies in ten calls, each of which returns a status that is 0 where it succeeded:
 *
 *     kschur_problem *problem = NULL;
 *     kschur_options *options = NULL;
 *     kschur_result *result = NULL;
 *     kschur_problem_create(&problem);
 *     kschur_problem_set_triplets(problem, KSCHUR_MASS, n, n, entries, 0, row, column, value);
 *     kschur_problem_set_csr(problem, KSCHUR_STIFFNESS, n, n, entries, 0, row_start, column, value);
 *     kschur_options_create(&options);
 *     kschur_options_set_modes(options, 5);
 *     kschur_result_create(&result);
 *     if (kschur_solve(problem, options, result) != KSCHUR_OK)
 *         kschur_result_get_message(result, text, sizeof text);
 *     kschur_result_get_frequencies_hz(result, frequencies, 5);
 *     kschur_result_destroy(&result);  kschur_options_destroy(&options);  kschur_problem_destroy(&problem);
 *
 * Rules for every function
 *
 *   Status     0 (KSCHUR_OK) or one of KSCHUR_ERROR_*. A function that fails changes nothing but the message,
 *              except kschur_solve*, which leave an empty result.
 *   Message    One sentence about the last failure, on the handle that the function works on: the result for
 *              kschur_solve*, else the first argument; read it with kschur_*_get_message. Where there is no handle,
 *              kschur_status_text says what a status means.
 *   Null       A null handle, array, text or place for an answer is KSCHUR_ERROR_NULL, unless it is optional.
 *   Ownership  Inputs are copied, so that they may be freed at once. Outputs go to memory of the caller. A handle is
 *              made by its _create and ended by its _destroy, which sets it to NULL.
 *   Lengths    int64_t. `length` says how many elements an array of the caller has room for; too few is
 *              KSCHUR_ERROR_LENGTH and nothing is written. Texts end in '\0', which counts; a text that does not fit is
 *              cut, and the status is KSCHUR_ERROR_LENGTH. Too long is never wrong.
 *   Complex    Numbers are pairs of doubles, real part first: `double complex *` in C99 and `std::complex<double> *` in
 *              C++ may be cast to `double *`. Lengths count doubles.
 *   Flags      int, 0 for no, anything else for yes.
 *   Indices    Those of arrays count from 0. Messages and notes count rows, columns and modes from the index base of the
 *              matrix that was set last.
 *   Units      Those of the matrices. With SI units eigenvalues are in 1/s. Frequencies are in Hz where their name
 *              says so.
 *   Threads    All functions may be called from any thread. One handle must not be used by two threads at the same
 *              time, except that any number of kschur_solve* may share a problem and options that nobody changes
 *              meanwhile.
 *              MUMPS, METIS, HDF5 and ARPACK keep state: a thread waits until no other one is in the same library. A
 *              program that calls them itself must not do so while another thread calls kschur.
 *   Callbacks  They are called by the thread that called kschur_solve*, and may call kschur with other handles; that
 *              ARPACK is iterated within an iteration of ARPACK is an error. They must return: no exception, no longjmp.
 */
#ifndef KSCHUR_H
#define KSCHUR_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Version ---------------------------------------------------------------------------------------------------- */

#define KSCHUR_VERSION_MAJOR 0
#define KSCHUR_VERSION_MINOR 1
#define KSCHUR_VERSION_PATCH 0
/* One number that grows with the version: 10000 major + 100 minor + patch. */
#define KSCHUR_VERSION (10000 * KSCHUR_VERSION_MAJOR + 100 * KSCHUR_VERSION_MINOR + KSCHUR_VERSION_PATCH)

/* The version of the library that runs, where the macros are those of the header that was compiled. Each place is
 * optional. Never fails. */
int kschur_version(int *major, int *minor, int *patch);

/* ---- Status ----------------------------------------------------------------------------------------------------- */

enum kschur_status {
   KSCHUR_OK = 0,
   KSCHUR_ERROR_USAGE = 1,       /* an option or argument that is wrong or does not fit the problem */
   KSCHUR_ERROR_INPUT = 2,       /* a matrix, a shape, a value, a file's content that cannot be right */
   KSCHUR_ERROR_FILE = 3,        /* a file that cannot be opened, read or written */
   KSCHUR_ERROR_MEMORY = 4,      /* out of memory */
   KSCHUR_ERROR_SINGULAR = 5,    /* the matrix to be factored is singular */
   KSCHUR_ERROR_LIBRARY = 6,     /* a library below this one failed */
   KSCHUR_ERROR_CONVERGENCE = 7, /* a linear solver that iterates came to no solution */
   KSCHUR_ERROR_NULL = 21,       /* a null handle or pointer */
   KSCHUR_ERROR_ORDER = 22,      /* a call before the one that it needs */
   KSCHUR_ERROR_LENGTH = 23,     /* an array or text of the caller is too short */
   KSCHUR_ERROR_CALLBACK = 24    /* a callback returned a failure */
};

/* What a status means, in words. KSCHUR_ERROR_USAGE for a number that is no status; fails also as texts do. */
int kschur_status_text(int status, char *text, int64_t length);

/* ---- Problem ---------------------------------------------------------------------------------------------------- */

/* The four matrices of a problem. */
typedef struct kschur_problem kschur_problem;

/* Which matrix. Mass and stiffness must be set; without damping R is zero, without constraints m is 0. */
enum kschur_matrix { KSCHUR_MASS = 0, KSCHUR_STIFFNESS = 1, KSCHUR_DAMPING = 2, KSCHUR_CONSTRAINTS = 3 };

/* Makes a problem without matrices; *problem is overwritten. KSCHUR_ERROR_MEMORY. */
int kschur_problem_create(kschur_problem **problem);

/* Ends a problem and sets *problem to NULL; nothing happens where it is NULL already. */
int kschur_problem_destroy(kschur_problem **problem);

/* The message of the last failure of a call with this problem as first argument; empty where none failed. */
int kschur_problem_get_message(const kschur_problem *problem, char *text, int64_t length);

/* Sets a matrix from compressed sparse rows, in place of what it was. Row i has the entries row_start[i] -
 * index_base to row_start[i+1] - index_base - 1 of `column` and `value`. Within a row columns may stand in any
 * order; repeated entries are summed. A symmetric matrix needs both its triangles. `rows` + 1 row starts; `entries`
 * columns and values. KSCHUR_ERROR_USAGE for an unknown matrix or an index base other than 0 and 1;
 * KSCHUR_ERROR_INPUT for wrong row starts and indices, and sizes above 2^31 - 2. Whether the matrices fit each other
 * is looked at when they are used. */
int kschur_problem_set_csr(kschur_problem *problem, int matrix, int64_t rows, int64_t columns, int64_t entries,
                           int index_base, const int32_t *row_start, const int32_t *column, const double *value);

/* The same with 64-bit indices. */
int kschur_problem_set_csr64(kschur_problem *problem, int matrix, int64_t rows, int64_t columns, int64_t entries,
                             int index_base, const int64_t *row_start, const int64_t *column, const double *value);

/* Sets a matrix from triplets (row, column, value) in any order, in place of what it was; values of the same place are
 * summed. Errors as kschur_problem_set_csr. */
int kschur_problem_set_triplets(kschur_problem *problem, int matrix, int64_t rows, int64_t columns, int64_t entries,
                                int index_base, const int32_t *row, const int32_t *column, const double *value);

/* The same with 64-bit indices. */
int kschur_problem_set_triplets64(kschur_problem *problem, int matrix, int64_t rows, int64_t columns, int64_t entries,
                                  int index_base, const int64_t *row, const int64_t *column, const double *value);

/* Says where the unknowns stand in space, for pictures and in files; nothing of it is needed to solve. `coordinates` are
 * x, y, z of one node after the other. Of each of the n unknowns `node` is the node it belongs to, counted from the index
 * base, or the number before the first for none, and `component` what it is there: 0, 1, 2 translations along x, y, z; 3,
 * 4, 5 rotations about them. Both may be NULL: the unknowns stand node after node then, 6, 3, 2 (x and y) or 1 (z) of
 * each. Whether this fits the matrices is looked at when they are used. KSCHUR_ERROR_USAGE, KSCHUR_ERROR_INPUT. */
int kschur_problem_set_nodes(kschur_problem *problem, int64_t nodes, const double *coordinates, int64_t unknowns,
                             int index_base, const int32_t *node, const int32_t *component);

/* Says which nodes make cells, in VTK's layout: cell c has the nodes offset[c] to offset[c+1] - 1 of `node`, counted from
 * the index base, and VTK's number type[c]. Without cells a result has lines between nodes that the stiffness joins.
 * KSCHUR_ERROR_ORDER before kschur_problem_set_nodes. */
int kschur_problem_set_cells(kschur_problem *problem, int64_t cells, int index_base, const int32_t *offset,
                             const int32_t *node, const int32_t *type);

/* The number of unknowns n and of constraints m; each place is optional. Checks the problem first:
 * KSCHUR_ERROR_ORDER where the mass or stiffness matrix is not set, KSCHUR_ERROR_INPUT where the matrices do not fit
 * each other or hold what is no finite number, where the mass is zero, a constraint empty, or m above n. */
int kschur_problem_get_size(kschur_problem *problem, int64_t *unknowns, int64_t *constraints);

/* Reads a problem from an HDF5 file of `kschur`'s format, in place of all matrices. KSCHUR_ERROR_FILE,
 * KSCHUR_ERROR_INPUT. */
int kschur_problem_read_hdf5(kschur_problem *problem, const char *path);

/* Writes a problem into an HDF5 file, which appears under its name when it is whole. Checks the problem first.
 * KSCHUR_ERROR_FILE. */
int kschur_problem_write_hdf5(kschur_problem *problem, const char *path);

/* ---- Options ---------------------------------------------------------------------------------------------------- */

/* What to compute and how. A setter that fails leaves the option as it was. */
typedef struct kschur_options kschur_options;

/* Makes options that all have their defaults; *options is overwritten. KSCHUR_ERROR_MEMORY. */
int kschur_options_create(kschur_options **options);

/* Ends options and sets *options to NULL; nothing happens where it is NULL already. */
int kschur_options_destroy(kschur_options **options);

/* The message of the last failure of a setter. */
int kschur_options_get_message(const kschur_options *options, char *text, int64_t length);

/* Sets an option by its name, that of its setter: "modes", "target", "target_hz", "shift", "method", ... to a value as on the
 * command line: "20", "1e-10", "0,31.4", "on" or "off", a name. KSCHUR_ERROR_USAGE for an unknown name and as the setter. */
int kschur_options_set(kschur_options *options, const char *name, const char *value);

/* How many modes: at least 1; a complex-conjugate pair is one, multiplicities count. Default 10. */
int kschur_options_set_modes(kschur_options *options, int64_t modes);

/* The modes nearest to this lambda are wanted (1/s). Default 0. */
int kschur_options_set_target(kschur_options *options, double re, double im);

/* The modes nearest to this frequency (Hz), at least 0, are wanted: the target i 2 pi frequency. */
int kschur_options_set_target_hz(kschur_options *options, double frequency);

/* Where to factor (1/s). By default it is chosen at the scale of the wanted modes. */
int kschur_options_set_shift(kschur_options *options, double re, double im);

/* Lets the shift be chosen again. */
int kschur_options_clear_shift(kschur_options *options);

/* "krylov-schur" (default), with Lanczos for symmetric formulations, or "arpack". */
int kschur_options_set_method(kschur_options *options, const char *name);

/* What "arpack" does: "fair" (default), ARPACK in the place of Krylov-Schur and everything else the same, or
 * "plain", as the paper compares with it, with nothing eliminated, deflated or refined. */
int kschur_options_set_arpack(kschur_options *options, const char *name);

/* "auto" (default), "symmetric", "proportional", "quadratic", "undamped", "undamped-negative", "undamped-constrained",
 * "undamped-constrained-zero", "damped", "damped-constrained", "damped-constrained-zero", "dense" or "low-rank". */
int kschur_options_set_formulation(kschur_options *options, const char *name);

/* "row" (default), "scalar" or "none": how constraints are scaled. */
int kschur_options_set_constraint_scaling(kschur_options *options, const char *name);

/* "auto" (default), "mumps", "ldl" or "iterative": what factors and solves. "iterative" may fail with
 * KSCHUR_ERROR_CONVERGENCE when it solves. */
int kschur_options_set_inner(kschur_options *options, const char *name);

/* Largest dimension of the Krylov space, but for what a verification needs beside what is locked; 0 (default): chosen
 * from the number of modes. */
int kschur_options_set_subspace(kschur_options *options, int64_t dimension);

/* Residual of a Ritz pair, relative to its value, at which it has converged: above 0, below 1. Default 1e-12. */
int kschur_options_set_tolerance(kschur_options *options, double tolerance);

/* The iteration gives up instead of making this restart: at least 1. Default 200. */
int kschur_options_set_max_restarts(kschur_options *options, int64_t restarts);

/* Vectors that the Krylov space grows by at a time; 0 (default): as many as cost least. */
int kschur_options_set_block(kschur_options *options, int64_t block);

/* Threads that compute; 0 (default): as many cores as the process may use, shared among the solves that run at the same
 * time. Any number gives the same digits, but for those of large matrices that MUMPS factors. */
int kschur_options_set_threads(kschur_options *options, int64_t threads);

/* libkschur_mpi_capi only: the communicator of several processes, each of which calls kschur_solve or kschur_solve_band with
 * it, as MPI_Comm_c2f(communicator) gives it. Problem, options and result are those of its first process: the others may give
 * NULL as problem and get no result. An error is the same in all. Without it, and by default, a process works alone. */
int kschur_options_set_communicator(kschur_options *options, int communicator);

/* With a communicator: matrices of so many rows and more are factored by all processes together: at least 1. Default 20000. */
int kschur_options_set_distribute(kschur_options *options, int64_t rows);

/* With a communicator: how many groups of processes share the parts of a band, or of a list of 500 modes and more, each with
 * factors of its own; 0 (default): each process is one where a matrix is too small to be distributed, else all together. */
int kschur_options_set_groups(kschur_options *options, int64_t groups);

/* Whether clamped and tied unknowns are eliminated first. Default yes. */
int kschur_options_set_presolve(kschur_options *options, int flag);

/* "length" (default): shapes of unit Euclidean norm; "mass": phi^* M phi = 1; "displacement": the largest entry is 1. The
 * largest entry is real and positive in each case, left vectors are of unit Euclidean norm. */
int kschur_options_set_normalisation(kschur_options *options, const char *name);

/* Whether left eigenvectors and condition numbers are computed as well. Default no. */
int kschur_options_set_left(kschur_options *options, int flag);

/* Whether the eigenvalues about the target are counted where nothing else proves that no mode is missing: for any
 * damping, with some 20 to 120 complex factorisations. Default no. */
int kschur_options_set_certify(kschur_options *options, int flag);

/* Seed of the random start vector. Default 1; the same seed gives the same digits. */
int kschur_options_set_seed(kschur_options *options, int64_t seed);

/* A file that the state of the iteration is written to now and then, whole or not at all; "" (default): none. A solve that could
 * not write it goes on, and a note says so. */
int kschur_options_set_checkpoint(kschur_options *options, const char *path);

/* The file that such a solve of the same problem with the same options left, to go on from with the same digits; "" (default):
 * none. KSCHUR_ERROR_INPUT when it is solved, where it is not of this problem and these options, or damaged. */
int kschur_options_set_resume(kschur_options *options, const char *path);

/* Told each time that convergence was looked at: the number of restarts so far, how many of the wanted values have
 * converged, the largest relative residual among the wanted ones. Returns 0 to go on; anything else ends the
 * computation with what has converged, which is a success with the reason KSCHUR_REASON_CANCELLED. */
typedef int (*kschur_progress_callback)(void *context, int64_t restart, int64_t converged, int64_t wanted,
                                        double residual);

/* Sets the progress callback and what it gets as context; NULL for none. The context is borrowed: it must live as
 * long as the options are used. */
int kschur_options_set_progress(kschur_options *options, kschur_progress_callback progress, void *context);

/* The linear solver of a caller, in place of the library's. One computation factors several matrices, and several
 * factorizations live at the same time; threads that share the options call it at the same time. */

/* Factors a square matrix of order n in compressed sparse rows, 0-based, columns in ascending order, both triangles of
 * a symmetric one; complex values are pairs of doubles. A matrix with constraints has zeros on its diagonal. The arrays
 * belong to the library and must not be kept. *factors is NULL and may be set to anything; it is handed to the other
 * two. Returns 0; KSCHUR_ERROR_SINGULAR, upon which the library may try another shift; or anything else to fail. */
typedef int (*kschur_factorize_callback)(void *context, int64_t n, int64_t entries, const int32_t *row_start,
                                         const int32_t *column, const double *value, int symmetric, void **factors);

/* x := A^-1 x for a block of columns of length n, one after the other; with `adjoint` A^-T x for a real matrix and
 * A^-H x (conjugate transpose) for a complex one. Returns 0, or anything else to fail. */
typedef int (*kschur_solve_callback)(void *context, void *factors, int adjoint, int64_t n, int64_t vectors, double *x);

/* Frees what one factorization made; called once for each that returned 0. */
typedef void (*kschur_release_callback)(void *context, void *factors);

/* Sets the solver for real matrices, which are those of any problem at a real shift, the default where the target is
 * 0. `release` is optional; NULL for `factorize` and `solve` brings the library's own back. The context is borrowed
 * as that of the progress callback. With a caller's solver nothing is counted: results are not certified, and bands
 * are not counted. It excludes kschur_options_set_inner. KSCHUR_ERROR_NULL where only one of `factorize` and `solve`
 * is given. */
int kschur_options_set_real_solver(kschur_options *options, kschur_factorize_callback factorize,
                                   kschur_solve_callback solve, kschur_release_callback release, void *context);

/* Sets the solver for complex matrices: complex shifts, the paper's pencils, modes that are refined. */
int kschur_options_set_complex_solver(kschur_options *options, kschur_factorize_callback factorize,
                                      kschur_solve_callback solve, kschur_release_callback release, void *context);

/* ---- Solve ------------------------------------------------------------------------------------------------------ */

/* Modes, how good they are, how they were found. */
typedef struct kschur_result kschur_result;

/* Makes an empty result; *result is overwritten. KSCHUR_ERROR_MEMORY. */
int kschur_result_create(kschur_result **result);

/* Ends a result and sets *result to NULL; nothing happens where it is NULL already. */
int kschur_result_destroy(kschur_result **result);

/* The message of the last failure of a call with this result: of a solve, a getter, a reader or writer. */
int kschur_result_get_message(const kschur_result *result, char *text, int64_t length);

/* Computes the modes nearest to the target; they replace what the result held. Fewer modes than asked for are a
 * success with a reason: see kschur_result_get_reason. Fails as kschur_problem_get_size; KSCHUR_ERROR_USAGE for
 * options that do not fit the problem, KSCHUR_ERROR_INPUT and KSCHUR_ERROR_SINGULAR for a problem that is singular
 * for every lambda, KSCHUR_ERROR_CONVERGENCE where an iterative inner solver comes to no solution,
 * KSCHUR_ERROR_MEMORY, KSCHUR_ERROR_LIBRARY, KSCHUR_ERROR_CALLBACK. The result is empty after a failure. */
int kschur_solve(kschur_problem *problem, const kschur_options *options, kschur_result *result);

/* Computes all modes whose natural frequency (Hz) lies in a band, 0 <= first < last; number of modes, target and
 * shift of the options are not looked at. No mode in the band is a success with no modes. Fails as kschur_solve, and
 * where there are more than 10,000 modes in the band, or 2,000 below its end where they cannot be counted. */
int kschur_solve_band(kschur_problem *problem, double first_hz, double last_hz, const kschur_options *options,
                      kschur_result *result);

/* A solver that remembers what it found out about a problem, for other targets, bands and values. One thread at a time
 * may use it. */
typedef struct kschur_solver kschur_solver;

/* Makes a solver without a problem; *solver is overwritten. KSCHUR_ERROR_MEMORY. */
int kschur_solver_create(kschur_solver **solver);

/* Ends a solver and sets *solver to NULL; nothing happens where it is NULL already. */
int kschur_solver_destroy(kschur_solver **solver);

/* The message of the last failure of kschur_solver_set_problem or kschur_solver_solve_targets. */
int kschur_solver_get_message(const kschur_solver *solver, char *text, int64_t length);

/* Gives the solver a copy of a problem, or of the same one with other values: what is known stays where the patterns, mass
 * and constraints are the same and nothing is rigid. KSCHUR_ERROR_INPUT for other numbers of unknowns or constraints. */
int kschur_solver_set_problem(kschur_solver *solver, kschur_problem *problem);

/* As kschur_solve, whose failures it has; KSCHUR_ERROR_ORDER without a problem, KSCHUR_ERROR_USAGE for options with linear
 * solvers of a caller. */
int kschur_solver_solve(kschur_solver *solver, const kschur_options *options, kschur_result *result);

/* The modes nearest to each of `count` targets, pairs of doubles (1/s), the target of the options left aside: results[i] is
 * what kschur_solver_solve gives for targets[i]. Targets that lie together share factors and a Krylov space. The results
 * are different ones, made by the caller; after a failure they are empty. KSCHUR_ERROR_USAGE for a count below 1. */
int kschur_solver_solve_targets(kschur_solver *solver, int64_t count, const double *targets, const kschur_options *options,
                                kschur_result *const *results);

/* As kschur_solve_band. */
int kschur_solver_solve_band(kschur_solver *solver, double first_hz, double last_hz, const kschur_options *options,
                             kschur_result *result);

/* y = C x for a block of vectors: x and y are arrays of n rows and `vectors` columns, column after column, of doubles
 * or of complex numbers. They do not overlap, and belong to the library: they must not be kept. Returns 0, or anything
 * else to fail. */
typedef int (*kschur_apply_callback)(void *context, int64_t n, int64_t vectors, const double *x, double *y);

/* Eigenvalues and eigenvectors of a real operator known only by what it does to vectors, C x = mu x. `which` is
 * "largest-magnitude", "smallest-magnitude", "largest-real", "smallest-real", "largest-imaginary", "smallest-
 * imaginary" or "nearest-target". Of the options the number of modes (here each eigenvalue counts), target,
 * subspace, tolerance, restarts, seed and progress are looked at. The result holds eigenvalues, eigenvectors of unit
 * norm, reason, counts and history; other getters return KSCHUR_ERROR_ORDER. KSCHUR_ERROR_USAGE,
 * KSCHUR_ERROR_MEMORY, KSCHUR_ERROR_LIBRARY, KSCHUR_ERROR_CALLBACK. */
int kschur_solve_real_operator(int64_t n, kschur_apply_callback apply, void *context, const char *which,
                               const kschur_options *options, kschur_result *result);

/* The same for an operator on complex vectors. */
int kschur_solve_complex_operator(int64_t n, kschur_apply_callback apply, void *context, const char *which,
                                  const kschur_options *options, kschur_result *result);

/* ---- Result ----------------------------------------------------------------------------------------------------- */
/* All of these return KSCHUR_ERROR_ORDER where the result does not hold what they give, as before a solve. Modes are
 * ordered by their distance from the target. */

/* How many modes there are, and how many were asked for; each place is optional. */
int kschur_result_get_modes(kschur_result *result, int64_t *found, int64_t *asked);

/* The number of unknowns n and of constraints m of the problem; each place is optional. */
int kschur_result_get_size(kschur_result *result, int64_t *unknowns, int64_t *constraints);

/* Eigenvalues (1/s), Im >= 0: a conjugate pair stands once. 2 * modes doubles. */
int kschur_result_get_eigenvalues(kschur_result *result, double *values, int64_t length);

/* Mode shapes phi, of unit Euclidean norm unless kschur_options_set_normalisation says otherwise, the largest entry real
 * and positive; one after the other: 2 * n * modes
 * doubles. */
int kschur_result_get_eigenvectors(kschur_result *result, double *values, int64_t length);

/* Lagrange multipliers xi, one mode after the other: 2 * m * modes doubles. */
int kschur_result_get_multipliers(kschur_result *result, double *values, int64_t length);

/* Natural frequencies |lambda| / 2 pi (Hz); of the two roots of one overdamped oscillator, its undamped frequency.
 * `modes` doubles. */
int kschur_result_get_frequencies_hz(kschur_result *result, double *values, int64_t length);

/* Damped frequencies |Im lambda| / 2 pi (Hz): `modes` doubles. */
int kschur_result_get_damped_frequencies_hz(kschur_result *result, double *values, int64_t length);

/* Damping ratios: `modes` doubles; NaN where undefined, as for a rigid-body mode. */
int kschur_result_get_damping_ratios(kschur_result *result, double *values, int64_t length);

/* Normwise backward errors: `modes` doubles. */
int kschur_result_get_backward_errors(kschur_result *result, double *values, int64_t length);

/* Bounds of the errors of the eigenvalues (1/s), backward error times condition number: `modes` doubles; NaN where
 * no left vector tells, as of unsymmetric problems without kschur_options_set_left. */
int kschur_result_get_errors(kschur_result *result, double *values, int64_t length);

/* What kind of mode it is. */
enum kschur_kind {
   KSCHUR_KIND_RIGID = 0,       /* a zero eigenvalue: a motion without strain */
   KSCHUR_KIND_UNDAMPED = 1,    /* an oscillation without decay */
   KSCHUR_KIND_UNDERDAMPED = 2, /* a decaying oscillation */
   KSCHUR_KIND_OVERDAMPED = 3,  /* one of the two decaying exponentials of an oscillator damped beyond critical */
   KSCHUR_KIND_UNSTABLE = 4,    /* an eigenvalue in the right half-plane */
   KSCHUR_KIND_REAL = 5         /* another decaying exponential */
};

/* Kinds: `modes` ints. */
int kschur_result_get_kinds(kschur_result *result, int *values, int64_t length);

/* The name of a kind, as "underdamped". KSCHUR_ERROR_USAGE for a number that is no kind. */
int kschur_kind_name(int kind, char *text, int64_t length);

/* Left vectors psi, psi^* P(lambda) + eta^* Cq = 0, where kschur_options_set_left asked for them: 2 * n * modes
 * doubles; NaN where none was found. */
int kschur_result_get_left_eigenvectors(kschur_result *result, double *values, int64_t length);

/* Multipliers eta of the left vectors: 2 * m * modes doubles. */
int kschur_result_get_left_multipliers(kschur_result *result, double *values, int64_t length);

/* Condition number of each eigenvalue, with the left vectors: `modes` doubles; infinite for a zero and for a defective
 * eigenvalue, NaN without a left vector. */
int kschur_result_get_condition_numbers(kschur_result *result, double *values, int64_t length);

/* Why the iteration ended. */
enum kschur_reason {
   KSCHUR_REASON_CONVERGED = 0,    /* all that was asked for has converged */
   KSCHUR_REASON_MAX_RESTARTS = 1, /* the restarts ran out first */
   KSCHUR_REASON_FEWER_MODES = 2,  /* there are no more modes; all of them are here */
   KSCHUR_REASON_CANCELLED = 3,    /* the progress callback ended it */
   KSCHUR_REASON_INACCURATE = 4,   /* a backward error above 1e-8, or modes missing without proof that there are none */
   KSCHUR_REASON_INTERRUPTED = 5   /* in results of the program that were read: a signal ended it */
};

/* One of KSCHUR_REASON_*. */
int kschur_result_get_reason(kschur_result *result, int *reason);

/* The name of a reason, as "max_restarts". KSCHUR_ERROR_USAGE for a number that is no reason. */
int kschur_reason_name(int reason, char *text, int64_t length);

/* Whether a count of eigenvalues proves that no mode is missing. */
enum kschur_certified {
   KSCHUR_CERTIFIED_UNKNOWN = 0, /* nothing was counted */
   KSCHUR_CERTIFIED_YES = 1,     /* no mode is missing */
   KSCHUR_CERTIFIED_NO = 2       /* the count and the modes differ */
};

/* One of KSCHUR_CERTIFIED_*. */
int kschur_result_get_certified(kschur_result *result, int *certified);

/* How many eigenvalues nearer to the target than the furthest mode are missing, both of a conjugate pair counted;
 * -1 where not known. Known only with kschur_options_set_certify. */
int kschur_result_get_missing(kschur_result *result, int64_t *missing);

/* How many notes there are: sentences a user must know beyond the reason. */
int kschur_result_get_note_count(kschur_result *result, int64_t *count);

/* Note number `index`, counted from 0; none is longer than 200 characters. KSCHUR_ERROR_USAGE for an index out of
 * range. */
int kschur_result_get_note(kschur_result *result, int64_t index, char *text, int64_t length);

/* The method that found the modes, as "krylov-schur". */
int kschur_result_get_method(kschur_result *result, char *text, int64_t length);

/* The formulation that was used, as "quadratic". */
int kschur_result_get_formulation(kschur_result *result, char *text, int64_t length);

/* Why this formulation was chosen. */
int kschur_result_get_decision(kschur_result *result, char *text, int64_t length);

/* Which solver factored the matrix, and why this one. */
int kschur_result_get_inner(kschur_result *result, char *text, int64_t length);

/* The target that was used (1/s); each place is optional. */
int kschur_result_get_target(kschur_result *result, double *re, double *im);

/* The shift that was used (1/s); each place is optional. */
int kschur_result_get_shift(kschur_result *result, double *re, double *im);

/* How many operator applications, restarts and factorizations it took; each place is optional. */
int kschur_result_get_counts(kschur_result *result, int64_t *operator_applications, int64_t *restarts,
                             int64_t *factorizations);

/* Wall-clock seconds in all, of the analysis, the factorizations, the solutions and the orthogonalisation; each
 * place is optional. */
int kschur_result_get_seconds(kschur_result *result, double *total, double *analyze, double *factorize, double *solve,
                              double *orthogonalize);

/* Order of the factored matrix and number of entries of its factors; each place is optional. */
int kschur_result_get_factors(kschur_result *result, int64_t *order, int64_t *entries);

/* How many constraints follow from the others. */
int kschur_result_get_redundant_constraints(kschur_result *result, int64_t *count);

/* How often convergence was looked at. */
int kschur_result_get_history_count(kschur_result *result, int64_t *count);

/* For each look at convergence: how many of the wanted values had converged, how often the operator had been
 * applied, the largest relative residual. Three arrays of `length` elements, each optional. */
int kschur_result_get_history(kschur_result *result, int64_t *converged, int64_t *operator_applications,
                              double *residual, int64_t length);

/* ---- Results by name and by part -------------------------------------------------------------------------------- */

/* Numbers by name, all as doubles, complex ones as pairs. Of modes: "eigenvalues", "eigenvectors", "multipliers",
 * "left_eigenvectors", "left_multipliers", "frequency_hz", "damped_frequency_hz", "damping_ratio", "backward_error", "error",
 * "kind", "condition_number". Of the solve: "n", "m", "modes", "modes_asked", "reason", "certified", "missing",
 * "redundant_constraints", "target", "shift", "operator_applications", "restarts", "factorizations", "factored_order",
 * "factor_entries", "seconds_total", "seconds_analyze", "seconds_factorize", "seconds_solve", "seconds_orthogonalize" and,
 * beside these four, "seconds_examine", "seconds_place", "seconds_iterate", "seconds_recover", "seconds_judge", "seconds_left".
 * Where the problem stands, nodes from 0: "coordinates", "unknown_node", "unknown_component", "cells_offsets", "cells_connectivity",
 * "cells_types". After kschur_result_find_properties: "generalised_mass", "generalised_damping",
 * "generalised_stiffness", "modal_a", "modal_b", "participation_factors", "effective_mass", "total_mass". KSCHUR_ERROR_USAGE for
 * another name. */
int kschur_result_get_numbers(kschur_result *result, const char *name, double *values, int64_t length);

/* How many doubles that is. */
int kschur_result_get_length(kschur_result *result, const char *name, int64_t *length);

/* Texts by name: "method", "formulation", "decision", "inner", "reason", "certified", "notes" (one a line), and after
 * kschur_result_find_properties "directions" (one a line). */
int kschur_result_get_text(kschur_result *result, const char *name, char *text, int64_t length);

/* Some modes, some rows of them, as real numbers if wanted. A part that is all zeros, `kschur_part part = {0}`, is all. */
typedef struct kschur_part {
   int64_t first;       /* the first mode, counted from 0 */
   int64_t count;       /* how many; 0: all from there on */
   const int64_t *rows; /* the unknowns or constraints that are wanted, counted from 0; NULL: all */
   int64_t row_count;   /* how many these are */
   int real;            /* whether real numbers are wanted in place of pairs */
} kschur_part;

/* A part of "eigenvectors", "multipliers", "left_eigenvectors" or "left_multipliers", one mode after the other.
 * KSCHUR_ERROR_USAGE for modes and rows that are not there, and where real numbers are wanted of modes that are not. */
int kschur_result_get_part(kschur_result *result, const char *name, const kschur_part *part, double *values,
                           int64_t length);

/* Whether the vector of a mode, counted from 0, is one of real numbers; `name` as in kschur_result_get_part. */
int kschur_result_is_real(kschur_result *result, const char *name, int64_t mode, int *real);

/* ---- What is made of modes -------------------------------------------------------------------------------------- */

/* Computes the properties of the modes of a problem, for the getters below. `directions` are `count` motions of all n
 * unknowns, one after the other, as 1 along x and 0 else; with 0 they are the rigid motions x, y, z, rx, ry, rz of the
 * problem's nodes that move anything, and none without nodes. KSCHUR_ERROR_USAGE where the modes are not those of the
 * problem, or left vectors are missing that an unsymmetric problem needs. */
int kschur_result_find_properties(kschur_result *result, kschur_problem *problem, const double *directions,
                                  int64_t count);

/* Generalised masses phi^* M phi: `modes` doubles. */
int kschur_result_get_generalised_masses(kschur_result *result, double *values, int64_t length);

/* Generalised dampings phi^* R phi: `modes` doubles. */
int kschur_result_get_generalised_dampings(kschur_result *result, double *values, int64_t length);

/* Generalised stiffnesses phi^* K phi: `modes` doubles. */
int kschur_result_get_generalised_stiffnesses(kschur_result *result, double *values, int64_t length);

/* Modal a = psi^* (2 lambda M + R) phi, psi the left vector, conj(phi) where the problem is symmetric: 2 * modes
 * doubles. */
int kschur_result_get_modal_a(kschur_result *result, double *values, int64_t length);

/* Modal b = -lambda a: 2 * modes doubles. */
int kschur_result_get_modal_b(kschur_result *result, double *values, int64_t length);

/* Participation factors, the modes of one direction after the other: a direction that the constraints allow is the sum of
 * Re(factor phi) over all modes there are. 2 * modes * count doubles. */
int kschur_result_get_participation_factors(kschur_result *result, double *values, int64_t length);

/* Effective masses, which over all modes add up to the total, the modes of one direction after the other: modes * count
 * doubles. */
int kschur_result_get_effective_masses(kschur_result *result, double *values, int64_t length);

/* Total masses d^T M d of the directions: `count` doubles. */
int kschur_result_get_total_masses(kschur_result *result, double *values, int64_t length);

/* Modal assurance criterion |phi_i^* phi_j|^2/(|phi_i|^2 |phi_j|^2) of the modes i of one result and j of another, i
 * fastest: `modes` of the one times `modes` of the other doubles. KSCHUR_ERROR_USAGE where shapes are not equally long. */
int kschur_result_get_mac(kschur_result *result, kschur_result *other, double *values, int64_t length);

/* d lambda/d p of each mode, 2 * modes doubles: `changed` is the problem where the parameter p is larger by `step`, in
 * which the matrices are taken for linear. Modes of a multiple eigenvalue get the rates of what it splits into, in no
 * order; NaN where there is none, as of a double zero. KSCHUR_ERROR_USAGE as for properties. */
int kschur_result_get_rates(kschur_result *result, kschur_problem *problem, kschur_problem *changed, double step,
                            double *values, int64_t length);

/* The response x to `count` harmonic forces f of all n unknowns, one after the other, at `points` frequencies (Hz):
 * (lambda^2 M + lambda R + K) x + Cq^T xi = f, Cq x = 0, lambda = 2 pi i frequency. Complex numbers are pairs of doubles.
 * `response` takes n * count * points of them and `multipliers`, which may be NULL, m * count * points: unknowns fastest,
 * then forces. KSCHUR_ERROR_SINGULAR where an undamped mode has one of the frequencies. */
int kschur_problem_get_response(kschur_problem *problem, const double *frequencies, int64_t points, const double *forces,
                                int64_t count, double *response, double *multipliers);

/* Modes over a parameter, followed from point to point. One thread at a time may use it. */
typedef struct kschur_sweep kschur_sweep;

/* Makes a sweep without points. */
int kschur_sweep_create(kschur_sweep **sweep);

/* Ends a sweep and sets the pointer to NULL. */
int kschur_sweep_destroy(kschur_sweep **sweep);

/* The message of the last failure. */
int kschur_sweep_get_message(const kschur_sweep *sweep, char *text, int64_t length);

/* Solves at the next value of the parameter, which grows from point to point or falls, and finds out which mode is which. The
 * options are those of the first point. Fails as kschur_solve. */
int kschur_sweep_add(kschur_sweep *sweep, double value, kschur_problem *problem, const kschur_options *options);

/* How many branches, points and events there are; pointers may be NULL. */
int kschur_sweep_get_size(kschur_sweep *sweep, int64_t *branches, int64_t *points, int64_t *events);

/* Numbers by name: "values", one a point; "eigenvalues" (pairs), "frequency_hz", "damping_ratio" and "share", what is left of the
 * mode before, of the branches of each point, branches fastest, NaN where a branch is not; of the events "event_kind", 0 a
 * crossing, 1 a veering, 2 where it is not clear which mode is which, "event_first" and "event_second", the branches counted
 * from 0, -1 for none, and "event_value". */
int kschur_sweep_get_numbers(kschur_sweep *sweep, const char *name, double *values, int64_t length);

/* Writes a result into an HDF5 file, which appears under its name when it is whole. KSCHUR_ERROR_FILE. */
int kschur_result_write_hdf5(kschur_result *result, const char *path);

/* Reads a result that this function's counterpart or `kschur solve --output` wrote, in place of what the result held.
 * KSCHUR_ERROR_FILE, KSCHUR_ERROR_INPUT. */
int kschur_result_read_hdf5(kschur_result *result, const char *path);

#ifdef __cplusplus
}
#endif

#endif
