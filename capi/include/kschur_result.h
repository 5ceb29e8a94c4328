/*
 * kschur for C: modes, how good they are, how they were found. A part of kschur.h, which says what holds for every function: include that.
 */
#ifndef KSCHUR_RESULT_H
#define KSCHUR_RESULT_H

#ifdef __cplusplus
extern "C" {
#endif

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
   KSCHUR_REASON_INACCURATE = 4,   /* a backward error above 1e-8, no left vector, or modes missing without proof */
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
 * "kind", "condition_number", "loss_factor" (none without a loss matrix). Of the solve: "n", "m", "modes", "modes_asked", "reason", "certified", "missing",
 * "redundant_constraints", "target", "shift", "operator_applications", "restarts", "factorizations" and, by what they were
 * for, "factorizations_for_mass", ..._rigid_motions, ..._iteration, ..._refinement, ..._count, ..._left, "wanted_after" (0
 * where not all that was wanted converged), "factored_order",
 * "factor_entries", "seconds_total", "seconds_analyze", "seconds_factorize", "seconds_solve", "seconds_orthogonalize" and,
 * beside these four, "seconds_examine", "seconds_place", "seconds_iterate", "seconds_recover", "seconds_judge", "seconds_left".
 * Where the problem stands, nodes from 0: "coordinates", "unknown_node", "unknown_component", "cells_offsets", "cells_connectivity",
 * "cells_types", "transformation_indptr", "transformation_indices", "transformation_data". After kschur_result_find_properties: "generalised_mass", "generalised_damping",
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

/* ---- Files ------------------------------------------------------------------------------------------------------- */

/* Writes a result into an HDF5 file, which appears under its name when it is whole. KSCHUR_ERROR_FILE. */
int kschur_result_write_hdf5(kschur_result *result, const char *path);

/* Reads a result that this function's counterpart or `kschur solve --output` wrote, in place of what the result held.
 * KSCHUR_ERROR_FILE, KSCHUR_ERROR_INPUT. */
int kschur_result_read_hdf5(kschur_result *result, const char *path);

/* The same of the modes of a point, counted from 0, of a sweep that kschur_sweep_write_hdf5_results or `kschur sweep --shapes`
 * wrote. KSCHUR_ERROR_INPUT where the file has not the modes of this point. */
int kschur_result_read_hdf5_point(kschur_result *result, const char *path, int64_t point);

#ifdef __cplusplus
}
#endif

#endif
