!> Normalisation of mode shapes: unit length, unit modal mass, or largest displacement one.
module kschur_normalisation
   use kschur_description, only: quadratic_form
   use kschur_kinds, only: wp
   use kschur_lapack, only: dznrm2
   use kschur_options, only: normalisation_displacement, normalisation_length, normalisation_mass
   use kschur_problem, only: modal_problem_type
   use kschur_result, only: modal_result_type
   use kschur_text, only: text
   use kschur_tolerances, only: cancelled, rounding_of_row
   implicit none
   private
   public :: normalise_shapes

contains

   !> Normalises the shapes of a result as its options ask for, with the largest entry real and positive. Multipliers are scaled
   !> with their shapes; left vectors stay of unit length. For unit mass, rigid motions are made M-orthogonal; a shape without mass
   !> stays of unit length, which a note says.
   subroutine normalise_shapes(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      integer :: j, massless

      if (result%options%normalisation == normalisation_length) return
      if (result%options%normalisation == normalisation_mass) call orthogonalize_rigid(problem, result)
      massless = 0
      do j = 1, size(result%eigenvalues)
         associate (length => norm_of(problem, result%options%normalisation, result%eigenvectors(:, j)))
            if (length > 0) then
               call scale_mode(result, j, 1/length)
            else
               massless = massless + 1
            end if
         end associate
      end do
      if (massless > 0) call result%add_note("of unit length in place of unit mass, as "// &
         trim(merge("it has   ", "they have", massless == 1))//" none: "//text(massless)// &
         trim(merge(" mode ", " modes", massless == 1)))
   end subroutine normalise_shapes

   ! The norm by which a shape is divided: its largest entry, or the root of its modal mass; 0 if that mass is rounding.
   real(wp) function norm_of(problem, normalisation, phi)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: normalisation
      complex(wp), intent(in) :: phi(:)
      complex(wp) :: mass
      real(wp) :: terms

      if (normalisation == normalisation_displacement) then
         norm_of = maxval(abs(phi))
      else
         call quadratic_form(problem%mass, phi, mass, terms)
         norm_of = 0
         if (real(mass, wp) > max(rounding_of_row*terms, cancelled**2*problem%mass%infinity_norm())) norm_of = sqrt(real(mass, wp))
      end if
   end function norm_of

   ! Scales shape and multipliers of mode j.
   subroutine scale_mode(result, j, factor)
      type(modal_result_type), intent(inout) :: result
      integer, intent(in) :: j
      real(wp), intent(in) :: factor

      result%eigenvectors(:, j) = factor*result%eigenvectors(:, j)
      result%multipliers(:, j) = factor*result%multipliers(:, j)
   end subroutine scale_mode

   ! Makes rigid motions M-orthogonal to those before them, by Gram-Schmidt with two passes.
   subroutine orthogonalize_rigid(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      complex(wp), allocatable :: inertia(:, :)
      complex(wp) :: share
      integer, allocatable :: rigid(:)
      integer :: i, j, pass

      allocate (rigid, source=pack([(j, j=1, size(result%eigenvalues))], .not. abs(result%eigenvalues) > 0))
      if (size(rigid) < 2) return
      allocate (inertia(problem%unknowns(), size(rigid)), source=(0.0_wp, 0.0_wp))
      associate (phi => result%eigenvectors, xi => result%multipliers)
         do j = 1, size(rigid)
            associate (this => phi(:, rigid(j)))
               do pass = 1, 2
                  do i = 1, j - 1
                     associate (other => phi(:, rigid(i)), mass => dot_product(phi(:, rigid(i)), inertia(:, i)))
                        if (.not. abs(mass) > 0) cycle
                        share = dot_product(inertia(:, i), this)/mass
                        phi(:, rigid(j)) = this - share*other
                        xi(:, rigid(j)) = xi(:, rigid(j)) - share*xi(:, rigid(i))
                     end associate
                  end do
               end do
            end associate
            call set_phase(result, rigid(j))
            call problem%mass%add_product((1.0_wp, 0.0_wp), phi(:, rigid(j):rigid(j)), inertia(:, j:j))
         end do
      end associate
   end subroutine orthogonalize_rigid

   ! Scales mode j to unit length with the largest entry real and positive.
   subroutine set_phase(result, j)
      type(modal_result_type), intent(inout) :: result
      integer, intent(in) :: j
      complex(wp) :: factor

      associate (phi => result%eigenvectors(:, j))
         factor = phi(maxloc(abs(phi), 1))
         if (.not. abs(factor) > 0) return
         factor = conjg(factor)/abs(factor)/dznrm2(size(phi), phi, 1)
         result%eigenvectors(:, j) = factor*phi
         result%multipliers(:, j) = factor*result%multipliers(:, j)
      end associate
   end subroutine set_phase
end module kschur_normalisation
