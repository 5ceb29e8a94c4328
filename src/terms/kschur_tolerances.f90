!> When numbers are told apart: from rounding, from zero, from each other. Each follows a bound, or stands for a measurement.
module kschur_tolerances
   use kschur_kinds, only: wp
   implicit none
   private

   ! Zero.

   !> An iterated zero may be off by this, relative to the shift: a double zero moves by the root of a perturbation, which is
   !> rounding of a stiffness that is far above the shift. Chosen.
   real(wp), parameter, public :: nearly_zero = 1.0e-4_wp
   !> An eigenvalue below this part of the shift, or of the end of a band, is taken for a zero: ten times as much as those are
   !> off by. Of theta = lambda^2 it is the square.
   real(wp), parameter, public :: seems_zero = 1.0e-3_wp
   !> A sum below this part of the magnitudes of its terms is their rounding: gamma_n = n epsilon (Higham 2002, section 3.1)
   !> of some thousand terms. What changes less has settled.
   real(wp), parameter, public :: cancelled = 1.0e-12_wp
   !> What rounding leaves of a unit vector that depends on others is below this, where inverse iteration has enlarged its
   !> errors half a million times; so is what it leaves of a rate beside one that is not zero.
   real(wp), parameter, public :: dependent = 1.0e-10_wp
   !> The root of epsilon. What counts by its square (a length in an energy or in a Ritz value) is rounding below this part, and
   !> so is a force that is less than this part of its terms in every row, where a row of large units hides what others have.
   !> The compliance that constraints are given is as far below the stiffness as above rounding.
   real(wp), parameter, public :: root_epsilon = 1.0e-8_wp
   !> An entry of a vector counts as this part of the largest one at least, where the terms of a sum are added up, as it may be
   !> nothing but rounding of that: times `cancelled` it is some epsilon of the largest.
   real(wp), parameter, public :: blurred_entry = 1.0e-3_wp

   ! The same.

   !> Two eigenvalues closer than this, relative to their size, may be one found twice: a perturbation of 1e-10 splits a
   !> defective one so far. A gap in a spectrum is wider.
   real(wp), parameter, public :: same_value = 1.0e-5_wp
   !> Frequencies this close, relative to them, are the same to a user: the edge of a band takes in what is so near. Chosen.
   real(wp), parameter, public :: same_frequency = 1.0e-6_wp
   !> Eigenvalues of modes that were accepted are equal to rounding below this, relative to them: as `inaccurate_above`.
   real(wp), parameter, public :: equal_value = 1.0e-8_wp
   !> What is known to twelve digits (input that was written so, vectors at the default tolerance) is off by less than this:
   !> by ten units of the last of them.
   real(wp), parameter, public :: twelve_digits = 1.0e-11_wp
   !> The same of five digits, as files of short fields have them.
   real(wp), parameter, public :: five_digits = 1.0e-4_wp
   !> A number with a larger relative error is not known: a solution of a singular system, or the distance of the furthest
   !> mode, which a curve must not touch. Chosen.
   real(wp), parameter, public :: blurred_value = 1.0e-4_wp

   !> The sine of the angle between shapes that are one: what iteration from a shift far off leaves of other modes in them.
   real(wp), parameter, public :: same_shape = 1.0e-3_wp
   !> What is left of a state of unit norm in the span of others where it is no other than these. Measured: found from far off,
   !> shapes have a hundredth of their neighbours in them.
   real(wp), parameter, public :: dependent_state = 1.0e-2_wp

   !> A constraint of which less than this is left beside the others is replaced by what is left: the compliance that
   !> constraints are given, 1e-8, counts by the square of that, and refinement gains two digits a step.
   real(wp), parameter, public :: nearly_dependent = 1.0e-3_wp
   !> A constraint that nearly follows from others to this is told of: half of the digits may be lost.
   real(wp), parameter, public :: noted_below = 1.0e-6_wp
   !> A pivot may be this part of the largest one there is: the usual threshold of sparse LU (Duff, Erisman, Reid, Direct Methods
   !> for Sparse Matrices, 2017, section 5.4).
   real(wp), parameter, public :: usable_pivot = 0.1_wp

   !> A diagonal entry this many times above the other rows, and above what stands beside it, is a penalty. Chosen.
   real(wp), parameter, public :: penalty = 1.0e6_wp

   !> A matrix that differs from its transpose by less than this part of the entries is likely meant to be symmetric, and was
   !> rounded, or printed with few digits. Chosen.
   real(wp), parameter, public :: nearly_symmetric = 1.0e-3_wp

   ! Real.

   !> An imaginary part below this, relative to the eigenvalue, is rounding: two real eigenvalues that meet leave the axis by
   !> the root of epsilon.
   real(wp), parameter, public :: real_tolerance = 1.0e-8_wp

   ! Infinite.

   !> Beyond this, relative to the shift or to the lowest, an eigenvalue may be infinite: rounding brings one with a Jordan
   !> block of size 2 down to the inverse of the root of epsilon, and rounding of solutions a hundred times as far.
   real(wp), parameter, public :: too_far = 1.0e6_wp
   !> So may one that is above the rate typical of the matrices by this factor. Chosen.
   real(wp), parameter, public :: above_the_typical = 100
   !> An eigenvalue is hidden where lambda^2 M is less than this times the rounding of K: it would have fewer than six digits.
   real(wp), parameter, public :: hidden_inertia = 1.0e6_wp

   ! Too large or too small.

   !> Entries above this are not computed with, nor those below its inverse: a frequency is the root of a quotient of two, and
   !> lambda^4 and squares of forces stay within the range of double precision, 1e308, by some decades.
   real(wp), parameter, public :: largest_entry = 1.0e75_wp

   ! Good enough.

   !> A backward error above this deserves a note. Chosen.
   real(wp), parameter, public :: noted_above = 1.0e-10_wp
   !> A pair with a backward error above this is no mode of the problem. Chosen.
   real(wp), parameter, public :: spurious = 1.0e-5_wp
   !> Units further apart than this hide errors: a backward error of `above_all_rounding` in the large ones says little of the
   !> small.
   real(wp), parameter, public :: uneven = 1.0e6_wp
   !> Rayleigh's functional corrects an eigenvalue by less than this part of it: rounding of the factored matrix moves none more.
   real(wp), parameter, public :: correctable = 1.0e-3_wp
   !> A mode above this backward error does not count as converged: half of the digits. Chosen.
   real(wp), parameter, public :: inaccurate_above = 1.0e-8_wp
   !> A solution with a backward error below this is accepted: the default tolerance of the iteration.
   real(wp), parameter, public :: good_enough = 1.0e-12_wp
   !> A symmetric Ritz pair with this residual, relative to it, has its value to the square (Parlett, The Symmetric Eigenvalue
   !> Problem, 1998, section 11.7); refinement that changes less has settled; and a singular system that leaves a larger
   !> residual has no solution.
   real(wp), parameter, public :: known_well = 1.0e-6_wp
   !> What has a relative error above this may be anything; a gap this wide, relative to the distance, will do for a
   !> count. Chosen.
   real(wp), parameter, public :: may_be_anything = 1.0e-2_wp
   !> Refinement has reached rounding where a correction is more than this part of the one before (Higham 2002, section 12.1: each
   !> step takes away a factor, until nothing is left but rounding).
   real(wp), parameter, public :: slow_refinement = 0.5_wp
   !> A fixed-point iteration that contracts less than this in a turn is given up.
   real(wp), parameter, public :: contraction = 0.1_wp

   ! Rounding and singular.

   !> What rounding leaves of a sum of one sparse row, gamma_n of a dozen terms (Higham 2002, section 3.1): of terms that
   !> cancel, of a null vector after refinement, of one number that is computed in two ways.
   real(wp), parameter, public :: rounding_of_row = 16*epsilon(1.0_wp)
   !> An entry below this part of the largest of its row and of its column is rounding, as the cosine of a right angle times a few
   !> numbers.
   real(wp), parameter, public :: rounding_of_entry = 4*epsilon(1.0_wp)
   !> What rounding of its entries leaves of the energy of a null vector, relative to the terms: entries are sums of a few
   !> numbers, whose errors add up at worst. Measured on random problems: half of it.
   real(wp), parameter, public :: rounding_of_energy = 4*epsilon(1.0_wp)
   !> What elimination, a projection or a residual leaves below this part of its terms is rounding: gamma_n of short sums,
   !> growth of pivots included. So is what two entries of a symmetric matrix differ by.
   real(wp), parameter, public :: rounding_of_sums = 100*epsilon(1.0_wp)
   !> What is above this is none, by some hundred epsilon: backward errors of solutions that are to be refined, squares of
   !> singular values of scaled constraints (the rounding of C C^T is epsilon), entries that differ from alpha M + beta K.
   real(wp), parameter, public :: above_all_rounding = 1.0e-13_wp
   !> A shift this close to an eigenvalue, relative to it, is singular: rounding of what the operator enlarges so leaves others
   !> six digits.
   real(wp), parameter, public :: singular_shift = 1.0e-10_wp
   !> So is one where rounding makes this many times as much of deflated motions as is left of all others. Chosen.
   real(wp), parameter, public :: drowning = 10
   !> M scaled to a unit diagonal is definite where its least eigenvalue is above this: those of finite elements are
   !> above a hundredth (Wathen, IMA J. Numer. Anal. 7 (1987)).
   real(wp), parameter, public :: least_of_mass = 1.0e-4_wp
   !> What a random start vector hides with this probability is taken for not there. Chosen.
   real(wp), parameter, public :: improbable = 1.0e-10_wp
   !> A regularisation is above the backward error of the solver by this factor,
   real(wp), parameter, public :: above_rounding = 16
   !> and so far above the unit of the last place that a pivot of it and of rounding is never taken for a null pivot.
   real(wp), parameter, public :: visible_pivot = 1024*epsilon(1.0_wp)
   !> In units of the inverse of the regularisation: a null vector is enlarged more than this (by 1/||U^T E V|| for
   !> random E and up to thousands of null vectors),
   real(wp), parameter, public :: least_enlarged = 1.0e-2_wp
   !> and what is enlarged more than this is nearer to singular than rounding lets one tell.
   real(wp), parameter, public :: most_enlarged = 30
   !> An onset of instability is told to this part of the parameter: what a sweep promises, far above what eigenvalues are off by.
   real(wp), parameter, public :: onset_width = 1.0e-3_wp
end module kschur_tolerances
