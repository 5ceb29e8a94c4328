/*
 * kschur for C: what to compute and how. A part of kschur.h, which says what holds for every function: include that.
 */
#ifndef KSCHUR_OPTIONS_H
#define KSCHUR_OPTIONS_H

#ifdef __cplusplus
extern "C" {
#endif

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

/* "auto" (default), "mumps", "ldl" or "iterative": what factors and solves. "iterative", with factors in single
 * precision, may fail with KSCHUR_ERROR_CONVERGENCE when it solves. */
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
 * factors of its own; 0 (default): each process is one, or for distributed matrices as many as half of the machines' memory
 * holds. */
int kschur_options_set_groups(kschur_options *options, int64_t groups);

/* A solve that is estimated to take more memory than this, in bytes, takes "iterative" for "auto" if that stays below,
 * else it is refused before anything is factored, as KSCHUR_ERROR_MEMORY; 0 (default): none is. */
int kschur_options_set_memory(kschur_options *options, int64_t bytes);

/* Whether clamped and tied unknowns are eliminated first. Default yes. */
int kschur_options_set_presolve(kschur_options *options, int flag);

/* "length" (default): shapes of unit Euclidean norm; "mass": phi^* M phi = 1; "displacement": the largest entry is 1. The
 * largest entry is real and positive in each case, left vectors are of unit Euclidean norm. */
int kschur_options_set_normalisation(kschur_options *options, const char *name);

/* Whether left eigenvectors and condition numbers are computed as well. Default no. */
int kschur_options_set_left(kschur_options *options, int flag);

/* Whether the eigenvalues about the target are counted where nothing else proves that no mode is missing: for any
 * damping, with some 20 to 120 complex factorisations. Default 0: no more than the one factorisation by which symmetric
 * formulations count, which -1 leaves out too. By name: "on", and "off" for -1. */
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

/* Asked before each step that takes a while, and often within it, by the thread that called. Returns 0 to go on; anything else
 * ends the computation as the progress callback does, without what comes after the step. */
typedef int (*kschur_stop_callback)(void *context);

/* Sets the stop callback and what it gets as context, borrowed as that of the progress callback; NULL for none. */
int kschur_options_set_stop(kschur_options *options, kschur_stop_callback stop, void *context);

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

#ifdef __cplusplus
}
#endif

#endif
