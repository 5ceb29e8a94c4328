/*
 * kschur for C: what is made of modes, and solves one after the other. A part of kschur.h, which says what holds for every function: include that.
 */
#ifndef KSCHUR_STUDIES_H
#define KSCHUR_STUDIES_H

#ifdef __cplusplus
extern "C" {
#endif

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
 * then forces. `options`, which may be NULL, say the number of threads, and their stop callback ends it, which is no failure: `done`, which may be NULL, is
 * the number of frequencies whose response is there; what lies behind them is left as it was. KSCHUR_ERROR_SINGULAR where an
 * undamped mode has one of the frequencies. */
int kschur_problem_get_response(kschur_problem *problem, const double *frequencies, int64_t points, const double *forces,
                                int64_t count, const kschur_options *options, double *response, double *multipliers,
                                int64_t *done);

/* ---- Solves one after the other ---------------------------------------------------------------------------------- */

/* A solver that remembers what it found out about a problem, for other targets, bands and values. One thread at a time
 * may use it. The last factors of MUMPS stay in memory with it, until others are made or it is destroyed. */
typedef struct kschur_solver kschur_solver;

/* Makes a solver without a problem; *solver is overwritten. KSCHUR_ERROR_MEMORY. */
int kschur_solver_create(kschur_solver **solver);

/* Ends a solver and sets *solver to NULL; nothing happens where it is NULL already. */
int kschur_solver_destroy(kschur_solver **solver);

/* The message of the last failure of kschur_solver_set_problem, kschur_solver_solve_targets or kschur_solver_solve_bands. */
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

/* All modes of each of `count` bands, pairs of first and last frequency (Hz): results[i] is what kschur_solver_solve_band gives
 * for the i-th. Bands that overlap or touch are found as one. Results and failures as of kschur_solver_solve_targets. */
int kschur_solver_solve_bands(kschur_solver *solver, int64_t count, const double *edges_hz, const kschur_options *options,
                              kschur_result *const *results);

/* Modes over a parameter, followed from point to point. One thread at a time may use it. */
typedef struct kschur_sweep kschur_sweep;

/* Makes a sweep without points. */
int kschur_sweep_create(kschur_sweep **sweep);

/* Ends a sweep and sets the pointer to NULL. */
int kschur_sweep_destroy(kschur_sweep **sweep);

/* The message of the last failure. */
int kschur_sweep_get_message(const kschur_sweep *sweep, char *text, int64_t length);

/* Fills `problem`, which is empty and ends with the call, for a value of the parameter. Returns 0; else the point fails with
 * KSCHUR_ERROR_CALLBACK. */
typedef int (*kschur_problem_callback)(void *context, double value, kschur_problem *problem);

/* Sets who makes problems between two points, for the points that follow, and what it gets as context, which is borrowed: it must
 * live as long as points are added. NULL: matrices are interpolated, as if they were linear in the parameter. */
int kschur_sweep_set_problem(kschur_sweep *sweep, kschur_problem_callback problem, void *context);

/* Solves at the next value of the parameter, which grows from point to point or falls, and finds out which mode is which. The
 * options are those of the first point, the callbacks those of each. Fails as kschur_solve; a point that a callback ended is
 * not added, which is no failure. */
int kschur_sweep_add(kschur_sweep *sweep, double value, kschur_problem *problem, const kschur_options *options);

/* Copies the modes of the last point that was added into a result. KSCHUR_ERROR_ORDER where the sweep was read. */
int kschur_sweep_get_result(kschur_sweep *sweep, kschur_result *result);

/* How many branches, points and events there are; pointers may be NULL. */
int kschur_sweep_get_size(kschur_sweep *sweep, int64_t *branches, int64_t *points, int64_t *events);

/* Writes an HDF5 file, which kschur-campbell reads; `parameter` is the name of the parameter and `unit` its unit, NULL where not
 * known. KSCHUR_ERROR_FILE where it cannot be written. */
int kschur_sweep_write_hdf5(kschur_sweep *sweep, const char *parameter, const char *unit, const char *path);

/* The same, with the modes of points, shapes and geometry included: results[i] is that of point i, as kschur_sweep_get_result gave
 * it, NULL where its modes are not to be kept; there are as many as points. KSCHUR_ERROR_ORDER where one holds no modes. */
int kschur_sweep_write_hdf5_results(kschur_sweep *sweep, const char *parameter, const char *unit, const char *path,
                                    kschur_result *const *results);

/* Takes the place of a sweep by one that was written; no points can be added to it. KSCHUR_ERROR_FILE, KSCHUR_ERROR_INPUT. */
int kschur_sweep_read_hdf5(kschur_sweep *sweep, const char *path);

/* The name of the parameter as it was read, empty otherwise; KSCHUR_ERROR_LENGTH where `length` is too short. */
int kschur_sweep_get_parameter(kschur_sweep *sweep, char *text, int64_t length);

/* The same of its unit. */
int kschur_sweep_get_unit(kschur_sweep *sweep, char *text, int64_t length);

/* Whether a file holds a sweep: 1 or 0, 0 also where it cannot be read. */
int kschur_is_sweep(const char *path);

/* How many branches change their stability. */
int kschur_sweep_get_onsets(kschur_sweep *sweep, int64_t *onsets);

/* Numbers by name: "values", one a point, and "kept", 1 where the file that was read has the modes of the point, for
 * kschur_result_read_hdf5_point; "eigenvalues" (pairs), "frequency_hz", "damping_ratio" and "share", what is left of the
 * mode before, of the branches of each point, branches fastest, NaN where a branch is not; of the events "event_kind", 0 a
 * crossing, 1 a veering, 2 where it is not clear which mode is which, "event_first" and "event_second", the branches counted
 * from 0, -1 for none, and "event_value"; of the onsets "onset_branch", "onset_unstable", 1 where the branch is unstable from
 * there on and 0 where it is stable again, "onset_value", and "onset_within", how wide the bracket is in which it lies: a
 * thousandth of the value, or more where the mode was lost between two points. */
int kschur_sweep_get_numbers(kschur_sweep *sweep, const char *name, double *values, int64_t length);

#ifdef __cplusplus
}
#endif

#endif
