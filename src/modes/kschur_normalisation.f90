!> How long shapes are: of unit length, of unit mass, or with a largest entry of one.
module kschur_normalisation
   use kschur_description, only: form
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

   !> Gives the shapes of a result the length that its options ask for; multipliers go with their shapes, left vectors stay
   !> of unit length. The largest entry is real and positive. Of unit mass, rigid motions are made orthogonal in M; a shape
   !> without mass stays of unit length, which a note says.
   subroutine normalise_shapes(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      integer :: j, light

      if (result%options%normalisation == normalisation_length) return
      if (result%options%normalisation == normalisation_mass) call separate_rigid(problem, result)
      light = 0
      do j = 1, size(result%eigenvalues)
         associate (length => size_of(problem, result%options%normalisation, result%eigenvectors(:, j)))
            if (length > 0) then
               call scale_mode(result, j, 1/length)
            else
               light = light + 1
            end if
         end associate
      end do
      if (light > 0) call result%add_note("of unit length in place of unit mass, as "// &
         trim(merge("it has   ", "they have", light == 1))//" none: "//text(light)//trim(merge(" mode ", " modes", light == 1)))
   end subroutine normalise_shapes

   ! What is to be one; 0 where it cannot be.
   real(wp) function size_of(problem, normalisation, phi)
      type(modal_problem_type), intent(in) :: problem
      integer, intent(in) :: normalisation
      complex(wp), intent(in) :: phi(:)
      complex(wp) :: mass
      real(wp) :: terms

      if (normalisation == normalisation_displacement) then
         size_of = maxval(abs(phi))
      else
         call form(problem%mass, phi, mass, terms)
         size_of = 0
         if (real(mass, wp) > max(rounding_of_row*terms, cancelled**2*problem%mass%infinity_norm())) size_of = sqrt(real(mass, wp))
      end if
   end function size_of

   subroutine scale_mode(result, j, factor)
      type(modal_result_type), intent(inout) :: result
      integer, intent(in) :: j
      real(wp), intent(in) :: factor

      result%eigenvectors(:, j) = factor*result%eigenvectors(:, j)
      result%multipliers(:, j) = factor*result%multipliers(:, j)
   end subroutine scale_mode

   ! Each rigid motion loses what those before it have, in the inner product of a symmetric M.
   subroutine separate_rigid(problem, result)
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
   end subroutine separate_rigid

   ! The largest entry of a shape real and positive, the shape of unit length.
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
