!> Thresholds that separate numbers from rounding errors, from zero and from each other. Each follows from a bound or a
!> measurement, or is marked as chosen.
module kschur_tolerances
   use kschur_kinds, only: wp, single
   implicit none
   private

   ! Zero eigenvalues and rounding errors of sums.

   !> Error of a computed zero, relative to the shift: a double zero moves by the square root of a perturbation, the rounding of
   !> a stiffness far above the shift. Chosen.
   real(wp), parameter, public :: nearly_zero = 1.0e-4_wp
   !> An eigenvalue below this fraction of the shift, or of the end of a band, is taken as zero: ten times `nearly_zero`. Square
   !> it for theta = lambda^2.
   real(wp), parameter, public :: seems_zero = 1.0e-3_wp
   !> A sum below this fraction of the magnitudes of its terms is a rounding error: gamma_n = n epsilon (Higham 2002, section
   !> 3.1) for some thousand terms. Also the relative change at which iterations have settled.
   real(wp), parameter, public :: cancelled = 1.0e-12_wp
   !> Largest remainder, by rounding, of a unit vector that is linearly dependent on others, after inverse iteration has
   !> amplified errors 5e5 times; likewise of a rate next to a nonzero one.
   real(wp), parameter, public :: dependent = 1.0e-10_wp
   !> Square root of epsilon: relative rounding level of quantities that enter by their squares (a norm in an energy or a Ritz
   !> value), and of forces below this fraction of their terms in every row, whose rounding a row of large units would hide.
   !> Also the residual at which refinement has settled, and the regularisation of constraints, midway between rounding and the
   !> stiffness.
   real(wp), parameter, public :: root_epsilon = 1.0e-8_wp
   !> Lower bound of entries relative to the largest, when magnitudes of terms are summed: a smaller entry may be a rounding
   !> error of the largest one. Times `cancelled` it is some epsilon of the largest.
   real(wp), parameter, public :: blurred_entry = 1.0e-3_wp

   ! Equal numbers.

   !> Eigenvalues closer than this, relatively, may be one found twice: a perturbation of 1e-10 splits a defective one so far.
   !> Gaps of a spectrum are wider.
   real(wp), parameter, public :: same_value = 1.0e-5_wp
   !> Relative difference of frequencies, or of distances from a target, that users regard as equal: the edge of a band includes
   !> them. Chosen.
   real(wp), parameter, public :: same_frequency = 1.0e-6_wp
   !> Relative width of an interval of frequencies that is not cut again: a hundred times wider than eigenvalues that are taken as
   !> one (`same_value`), so that their copies are not divided. Chosen.
   real(wp), parameter, public :: narrowest_interval = 1.0e-3_wp
   !> Frequencies below this fraction of the highest are not looked for as the end of a list: `seems_zero`, squared for theta.
   real(wp), parameter, public :: seems_rigid = seems_zero**2
   !> Least distance of factors from an eigenvalue that they polish, relative to it: a step reduces what lies at a relative gap g by
   !> least_offset/g, and the growth 1/least_offset of rounding leaves ten digits of a solution, which its refinement restores.
   real(wp), parameter, public :: least_offset = 1.0e-6_wp
   !> Largest distance of factors from a cluster that they polish, relative to its eigenvalue. A step reduces what lies at a gap g
   !> by distance/g, so that it also is a thirtieth of the gap at most. Chosen.
   real(wp), parameter, public :: largest_offset = 1.0e-3_wp
   !> Change of a sort key, relative to that of the last wanted value, that alters no order users would notice: a tenth of
   !> `same_frequency`. Chosen.
   real(wp), parameter, public :: negligible_change = 1.0e-7_wp
   !> Condition number above which rounding may have split a double eigenvalue: a tenth of 1/sqrt(epsilon), as it is inversely
   !> proportional to the distance, the square root of rounding.
   real(wp), parameter, public :: split_by_rounding = 0.1_wp/sqrt(epsilon(1.0_wp))
   !> Relative difference of eigenvalues of accepted modes that are equal to rounding: as `inaccurate_above`.
   real(wp), parameter, public :: equal_value = 1.0e-8_wp
   !> Error of numbers with twelve digits (formatted input, vectors at the default tolerance): ten units of the last digit.
   real(wp), parameter, public :: twelve_digits = 1.0e-11_wp
   !> As above for five digits, as in files with short fields.
   real(wp), parameter, public :: five_digits = 1.0e-4_wp
   !> Largest relative error of a usable number: more means a singular system, or an unreliable distance of the furthest mode,
   !> which a curve must not touch. Chosen.
   real(wp), parameter, public :: blurred_value = 1.0e-4_wp

   !> Sine of the angle between shapes taken as equal: components of other modes left by iteration at a distant shift.
   real(wp), parameter, public :: same_shape = 1.0e-3_wp
   !> Remainder of a unit state below which it is linearly dependent on others. Measured: shapes from a distant shift have a
   !> hundredth of their neighbours in them.
   real(wp), parameter, public :: dependent_state = 1.0e-2_wp

   !> A constraint whose component independent of the others is smaller is replaced by that component: the regularisation 1e-8
   !> enters relative to its square, and refinement then gains two digits a step.
   real(wp), parameter, public :: nearly_dependent = 1.0e-3_wp
   !> A constraint dependent on others to this level is reported: half of the digits may be lost.
   real(wp), parameter, public :: noted_below = 1.0e-6_wp
   !> Pivot threshold relative to the largest: usual for sparse LU (Duff, Erisman, Reid, Direct Methods for Sparse Matrices,
   !> 2017, section 5.4).
   real(wp), parameter, public :: usable_pivot = 0.1_wp

   !> Cosine of half the angle of a sector that no pivot leaves, below which a complex factorisation without pivoting is given up:
   !> its inverse squared, a hundred, bounds the growth (C.-K. Li, N.-S. Sze, J. Math. Anal. Appl. 410 (2014)).
   real(wp), parameter, public :: narrowest_cosine = 0.1_wp

   !> A diagonal entry larger than other rows and its off-diagonal entries by this factor is a penalty. Chosen.
   real(wp), parameter, public :: penalty = 1.0e6_wp

   !> A matrix that differs from its transpose by less than this part of the entries is likely meant to be symmetric, and was
   !> rounded, or printed with few digits. Chosen.
   real(wp), parameter, public :: nearly_symmetric = 1.0e-3_wp

   ! Real eigenvalues.

   !> Relative imaginary part that is a rounding error: two real eigenvalues that meet leave the axis by the square root of
   !> epsilon.
   real(wp), parameter, public :: real_tolerance = 1.0e-8_wp

   ! Infinite eigenvalues.

   !> An eigenvalue above this, relative to the shift or the lowest one, may be infinite: rounding moves one with a Jordan block
   !> of size 2 down to 1/sqrt(epsilon), and errors of solves a hundred times further.
   real(wp), parameter, public :: too_far = 1.0e6_wp
   !> Likewise one above the typical rate of the matrices by this factor. Chosen.
   real(wp), parameter, public :: above_the_typical = 100
   !> An eigenvalue is hidden if lambda^2 M is below this multiple of the rounding of K: it would have fewer than six digits.
   real(wp), parameter, public :: hidden_inertia = 1.0e6_wp

   ! Range of entries.

   !> Entries above this, or below its inverse, are rejected: frequencies are square roots of quotients, and lambda^4 and
   !> squared forces stay within the range of double precision, 1e308, by some decades.
   real(wp), parameter, public :: largest_entry = 1.0e75_wp

   ! Backward errors.

   !> A backward error above this is reported in a note. Chosen.
   real(wp), parameter, public :: noted_above = 1.0e-10_wp
   !> A pair with a backward error above this is spurious. Chosen.
   real(wp), parameter, public :: spurious = 1.0e-5_wp
   !> Ratio of units above which errors may be hidden: a backward error of `above_all_rounding` in the large ones says little
   !> about the small ones.
   real(wp), parameter, public :: uneven = 1.0e6_wp
   !> Largest relative correction of an eigenvalue by the Rayleigh functional: rounding of the factored matrix moves none
   !> further.
   real(wp), parameter, public :: correctable = 1.0e-3_wp
   !> A mode with a larger backward error does not count as converged: half of the digits. Chosen.
   real(wp), parameter, public :: inaccurate_above = 1.0e-8_wp
   !> Largest backward error of an accepted solution: the default tolerance of the iteration.
   real(wp), parameter, public :: accepted_backward_error = 1.0e-12_wp
   !> Residual, relative to the Ritz value, at which a symmetric Ritz value is accurate to its square (Parlett, The Symmetric
   !> Eigenvalue Problem, 1998, section 11.7), and above which a singular system is inconsistent.
   real(wp), parameter, public :: known_well = 1.0e-6_wp
   !> A number with a larger relative error has no correct digits; also a sufficient relative gap for a count. Chosen.
   real(wp), parameter, public :: no_correct_digits = 1.0e-2_wp
   !> Refinement has stagnated at rounding when a correction exceeds this fraction of the previous one (Higham 2002, section
   !> 12.1).
   real(wp), parameter, public :: slow_refinement = 0.5_wp
   !> Reduction of a residual that one cycle of GMRES attempts: its backward error is some epsilon (Paige, Rozloznik, Strakos,
   !> SIAM J. Matrix Anal. Appl. 28 (2006)), times the largest condition number that single precision preconditions, 1e8.
   real(wp), parameter, public :: cycle_reduction = 1.0e-8_wp
   !> A fixed-point iteration with a larger contraction factor is abandoned.
   real(wp), parameter, public :: contraction = 0.1_wp

   ! Fits of proportional damping, and panels of curves.

   !> An entry of R that alpha M + beta K gives with a smaller relative error is not of a damper, while those are told from the
   !> others: a fit without them gives it to `above_all_rounding`. Chosen.
   real(wp), parameter, public :: agreeing_entry = 1.0e-9_wp
   !> Relative errors of such fits below this are equal: their median is bisected between it and the largest. Chosen.
   real(wp), parameter, public :: least_misfit = 1.0e-30_wp
   !> A panel that is a smaller part of its curve is not halved: an eigenvalue that is not listed lies next to it. Chosen.
   real(wp), parameter, public :: narrowest_panel = 1.0e-7_wp

   ! Rounding levels and singularity.

   !> Rounding of a sum over one sparse row, gamma_n of a dozen terms (Higham 2002, section 3.1): of cancelling terms, of a
   !> refined null vector, of a number computed in two ways.
   real(wp), parameter, public :: rounding_of_row = 16*epsilon(1.0_wp)
   !> An entry below this fraction of the largest of its row and of its column is a rounding error, as the cosine of a right
   !> angle times a few numbers.
   real(wp), parameter, public :: rounding_of_entry = 4*epsilon(1.0_wp)
   !> Energy of a null vector due to rounding of matrix entries, relative to the terms: entries are sums of a few numbers, whose
   !> errors may add up. Measured on random problems: half of it.
   real(wp), parameter, public :: rounding_of_energy = 4*epsilon(1.0_wp)
   !> Rounding level of eliminations, projections and residuals relative to their terms: gamma_n of short sums with pivot
   !> growth. Also of the difference of mirror entries of a symmetric matrix.
   real(wp), parameter, public :: rounding_of_sums = 100*epsilon(1.0_wp)
   !> Above all rounding, some hundred epsilon: backward errors of solutions that need refinement, squared singular values of
   !> scaled constraints (the rounding of C C^T is epsilon), deviations from alpha M + beta K.
   real(wp), parameter, public :: above_all_rounding = 1.0e-13_wp
   !> Likewise for factors in single precision: in units of its epsilon the same.
   real(wp), parameter, public :: above_all_single_rounding = above_all_rounding/epsilon(1.0_wp)*epsilon(1.0_single)
   !> Relative distance of a shift from an eigenvalue at which the matrix is singular: amplified rounding errors leave other
   !> vectors six digits.
   real(wp), parameter, public :: singular_shift = 1.0e-10_wp
   !> Also singular: a shift at which rounding components along deflated motions exceed all others by this factor. Chosen.
   real(wp), parameter, public :: deflated_growth = 10
   !> M scaled to unit diagonal is definite if its least eigenvalue is larger: those of finite elements are above a hundredth
   !> (Wathen, IMA J. Numer. Anal. 7 (1987)).
   real(wp), parameter, public :: least_of_mass = 1.0e-4_wp
   !> Most masses of finite elements are above this, as Wathen shows; where not, the random start proves nothing.
   real(wp), parameter, public :: usual_least_of_mass = 1.0e-2_wp
   !> Probability that a random start vector misses a component that exists; smaller ones are neglected. Chosen.
   real(wp), parameter, public :: improbable = 1.0e-10_wp
   !> Likewise that a verification misses a copy, where there is one. Chosen.
   real(wp), parameter, public :: improbable_miss = 1.0e-3_wp
   !> Ratio of a regularisation to the backward error of the solver,
   real(wp), parameter, public :: above_rounding = 16
   !> and its least size, so that a regularised pivot is never taken for a null pivot.
   real(wp), parameter, public :: visible_pivot = 1024*epsilon(1.0_wp)
   !> In units of the inverse of the regularisation: null vectors are amplified more than this (by 1/||U^T E V|| for random E
   !> and up to thousands of null vectors),
   real(wp), parameter, public :: least_enlarged = 1.0e-2_wp
   !> and larger amplification is nearer to singular than rounding can resolve.
   real(wp), parameter, public :: most_enlarged = 30
   !> Relative accuracy of an onset of instability: promised by sweeps, far above errors of eigenvalues.
   real(wp), parameter, public :: onset_width = 1.0e-3_wp
end module kschur_tolerances
