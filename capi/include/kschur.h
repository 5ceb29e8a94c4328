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
#define KSCHUR_VERSION_MINOR 2
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

/* The matrices of a problem. */
typedef struct kschur_problem kschur_problem;

/* Which matrix. Mass and stiffness must be set; without damping R is zero, without constraints m is 0. The loss matrix H adds
 * i H to the stiffness above the real axis (structural damping); without it there are no losses. The transformation T, N x n, is that of kschur_problem_set_nodes. */
enum kschur_matrix { KSCHUR_MASS = 0, KSCHUR_STIFFNESS = 1, KSCHUR_DAMPING = 2, KSCHUR_CONSTRAINTS = 3, KSCHUR_LOSS = 4,
                     KSCHUR_TRANSFORMATION = 5 };

/* Makes a problem without matrices; *problem is overwritten. KSCHUR_ERROR_MEMORY. */
int kschur_problem_create(kschur_problem **problem);

/* Ends a problem and sets *problem to NULL; nothing happens where it is NULL already. */
int kschur_problem_destroy(kschur_problem **problem);

/* The message of the last failure of a call with this problem as first argument; empty where none failed. */
int kschur_problem_get_message(const kschur_problem *problem, char *text, int64_t length);

/* Sets a matrix from compressed sparse rows, in place of what it was. Row i has the entries row_start[i] -
 * index_base to row_start[i+1] - index_base - 1 of `column` and `value`. Within a row columns may stand in any
 * order; repeated entries are summed. A symmetric matrix needs both its triangles,
 * or kschur_problem_set_symmetric. `rows` + 1 row starts; `entries`
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

/* Says how M, R, K and H are stored, those that are set and those that will be set or read. "lower", "upper": by this triangle
 * and the diagonal, as halves of symmetric matrices; entries in the other triangle must mirror those. "no": as they are.
 * "check", the default: as they are, but a matrix with entries in one triangle only, off the diagonal, none of which is
 * above sqrt(a_ii a_jj), is taken for a half that was meant to be completed. Either is KSCHUR_ERROR_INPUT when the
 * problem is used. KSCHUR_ERROR_USAGE for another name. */
int kschur_problem_set_symmetric(kschur_problem *problem, const char *name);

/* Says where the unknowns stand in space, for pictures and in files; nothing of it is needed to solve. `coordinates` are
 * x, y, z of one node after the other. Of each of the n unknowns `node` is the node it belongs to, counted from the index
 * base, or the number before the first for none, and `component` what it is there: 0, 1, 2 translations along x, y, z; 3,
 * 4, 5 rotations about them. Both may be NULL: the unknowns stand node after node then, 6, 3, 2 (x and y) or 1 (z) of
 * each. Whether this fits the matrices is looked at when they are used. Where unknowns were eliminated, as slaves of rigid
 * parts, a matrix KSCHUR_TRANSFORMATION that is set afterwards makes of the n unknowns the N that move the nodes, u = T q:
 * `node` and `component` are of those then, and cells must be given. KSCHUR_ERROR_USAGE, KSCHUR_ERROR_INPUT. */
int kschur_problem_set_nodes(kschur_problem *problem, int64_t nodes, const double *coordinates, int64_t unknowns,
                             int index_base, const int32_t *node, const int32_t *component);

/* Says which nodes make cells, in VTK's layout: cell c has the nodes offset[c] to offset[c+1] - 1 of `node`, counted from
 * the index base, and VTK's number type[c]. Without cells a result has lines between nodes that the stiffness joins.
 * KSCHUR_ERROR_ORDER before kschur_problem_set_nodes. */
int kschur_problem_set_cells(kschur_problem *problem, int64_t cells, int index_base, const int32_t *offset,
                             const int32_t *node, const int32_t *type);

/* The number of unknowns n and of constraints m; each place is optional. Checks the problem first:
 * KSCHUR_ERROR_ORDER where the mass or stiffness matrix is not set, KSCHUR_ERROR_INPUT where the matrices do not fit
 * each other or hold what is no finite number, where mass and damping are zero, a constraint empty, or a matrix half of a
 * symmetric one: see kschur_problem_set_symmetric. */
int kschur_problem_get_size(kschur_problem *problem, int64_t *unknowns, int64_t *constraints);

/* Reads a problem from an HDF5 file of `kschur`'s format, in place of all matrices. KSCHUR_ERROR_FILE,
 * KSCHUR_ERROR_INPUT. */
int kschur_problem_read_hdf5(kschur_problem *problem, const char *path);

/* Writes a problem into an HDF5 file, which appears under its name when it is whole. Checks the problem first.
 * KSCHUR_ERROR_FILE. */
int kschur_problem_write_hdf5(kschur_problem *problem, const char *path);

#include "kschur_options.h"

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

#ifdef __cplusplus
}
#endif

#include "kschur_result.h"
#include "kschur_studies.h"

#endif
