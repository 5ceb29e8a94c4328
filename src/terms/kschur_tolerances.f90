!> When numbers are told apart: from rounding, from zero, from each other.
module kschur_tolerances
   use kschur_kinds, only: wp
   implicit none
   private

   !> An imaginary part below this, relative to the eigenvalue, is rounding.
   real(wp), parameter, public :: real_tolerance = 1.0e-8_wp
   !> Two eigenvalues closer than this, relative to their size, may be one found twice.
   real(wp), parameter, public :: same_value = 1.0e-5_wp

   !> A pair of modes nearer to each other than this, while they are iterated, may be copies: the square root of the
   !> tolerance of their residuals.
   real(wp), parameter, public :: nearly_equal = 1.0e-6_wp
   !> The sine of the angle between shapes that are one: what iteration from a shift far off leaves of other modes in them.
   real(wp), parameter, public :: same_shape = 1.0e-3_wp
   !> What is left of a state of unit norm in the span of others where it is no other than these. Measured: found from far off,
   !> shapes have a hundredth of their neighbours in them.
   real(wp), parameter, public :: dependent_state = 1.0e-2_wp
   !> An eigenvalue that iteration put this near to an axis, relative to it, may lie on it: the square root of a residual
   !> splits a double one by less.
   real(wp), parameter, public :: near_axis = 1.0e-4_wp
   !> Rounding of the factored matrix moves eigenvalues that Rayleigh's functional may correct by less than this part of them.
   real(wp), parameter, public :: correctable = 1.0e-3_wp
   !> Zeros found by iteration are a ring of radius sqrt(epsilon) in units of the shift, and below this part of it.
   real(wp), parameter, public :: nearly_zero = 1.0e-4_wp
   !> An energy below this part of its terms is rounding, summed in more than the working precision.
   real(wp), parameter, public :: no_energy = 8*epsilon(1.0_wp)
   !> A real part below this, relative to the eigenvalue, is rounding of R or of an undamped problem.
   real(wp), parameter, public :: undamped_tolerance = 1.0e-11_wp

   !> A backward error that is good enough: a shape of a mode near the shift has no larger one (numbers of docs/results.md).
   real(wp), parameter, public :: good_enough = 1.0e-13_wp
   !> A backward error that deserves a note, and how well an eigenvalue is known at least where it is accepted, relative to it.
   real(wp), parameter, public :: known_well = 1.0e-10_wp
   !> A pair with a backward error above this is no mode of the problem.
   real(wp), parameter, public :: spurious = 1.0e-5_wp
   !> An eigenvalue that may be off by this part of it may be anything.
   real(wp), parameter, public :: anything = 1.0e-2_wp
   !> Units further apart than this hide errors: a backward error of `good_enough` in the large ones is none in the small.
   real(wp), parameter, public :: uneven = 1.0e6_wp

   !> A sum below this part of the magnitudes of its terms is their rounding: gamma_n = n epsilon (Higham 2002, section 3.1)
   !> of some thousand terms. What changes less has settled.
   real(wp), parameter, public :: cancelled = 1.0e-12_wp
   !> A null vector has a residual below this, in units of the norm of the matrix: what the rounding of a sparse row and of
   !> refined solutions leaves.
   real(wp), parameter, public :: null_residual = 16*epsilon(1.0_wp)
   !> What elimination or a projection leaves of a vector below this part of it is rounding: gamma_n of short sums, growth
   !> of pivots included.
   real(wp), parameter, public :: nothing_left = 100*epsilon(1.0_wp)
   !> What rounding leaves of a unit vector that depends on others is below this, where inverse iteration has enlarged its
   !> errors half a million times; so is what it leaves of a rate beside one that is not zero.
   real(wp), parameter, public :: dependent = 1.0e-10_wp
   !> A force that is below this part of its terms in every row, the root of epsilon, is none where it is rounding beside the
   !> whole matrix: a row of large units hides what others have.
   real(wp), parameter, public :: clear_force = 1.0e-8_wp
   !> An entry of a vector counts as this part of the largest one at least, where the terms of a sum are added up, as it may be
   !> nothing but rounding of that: times `cancelled` it is some epsilon of the largest.
   real(wp), parameter, public :: blurred_entry = 1.0e-3_wp

   !> The square of a singular value of the scaled constraints below this is zero: above the rounding of C C^T, epsilon times
   !> its norm, by some hundred times.
   real(wp), parameter, public :: null_constraint = 1.0e-13_wp
   !> M scaled to a unit diagonal is definite where its least eigenvalue is above this: those of finite elements are
   !> above a hundredth (Wathen, IMA J. Numer. Anal. 7 (1987)).
   real(wp), parameter, public :: least_of_mass = 1.0e-4_wp

   !> A regularisation is above the backward error of the solver by this factor,
   real(wp), parameter, public :: above_rounding = 16
   !> and so far above the unit of the last place that a pivot of it and of rounding is never taken for a null pivot.
   real(wp), parameter, public :: visible_pivot = 1024*epsilon(1.0_wp)
   !> In units of the inverse of the regularisation: a null vector is enlarged more than this (by 1/||U^T E V|| for
   !> random E and up to thousands of null vectors),
   real(wp), parameter, public :: least_enlarged = 1.0e-2_wp
   !> and what is enlarged more than this is nearer to singular than rounding lets one tell.
   real(wp), parameter, public :: most_enlarged = 30

   !> An eigenvalue is hidden where lambda^2 M is less than this times the rounding of K: it would have fewer than six digits.
   real(wp), parameter, public :: hidden_inertia = 1.0e6_wp
   !> A fixed-point iteration that contracts less than this in a turn is given up.
   real(wp), parameter, public :: contraction = 0.1_wp

   !> With more motions without mass than this the iteration is left to filter infinite eigenvalues, which costs less.
   integer, parameter, public :: most_massless = 64
   !> A symmetric form needs the infinite eigenvalue only where more than this part of the unknowns, as modes, is wanted.
   integer, parameter, public :: most_part = 4
end module kschur_tolerances
