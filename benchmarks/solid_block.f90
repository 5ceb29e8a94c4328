!> A block of an elastic solid, free or clamped at one end: the fill of three
!> dimensions. Each of its eight-node elements ties all of its unknowns, more
!> than the tetrahedra of the scenes do.
module solid_block
   use kschur, only: csr_matrix_type, error_type, modal_problem_type, new_csr_from_triplets, new_modal_problem, wp
   use kschur_sparse, only: linear_combination
   implicit none
   private
   public :: build_block

   ! Steel, cubes of 1 m.
   real(wp), parameter :: young = 2.1e11_wp, poisson = 0.3_wp, density = 7850
   real(wp), parameter :: alpha = 0.5_wp, beta = 1.0e-6_wp

contains

   !> size(1) x size(2) x size(3) eight-node elements with R = alpha M + beta K.
   subroutine build_block(size, clamped, problem, error)
      integer, intent(in) :: size(3)
      !> Whether the nodes of the first end stay where they are.
      logical, intent(in) :: clamped
      type(modal_problem_type), intent(out) :: problem
      type(error_type), allocatable, intent(out) :: error
      type(csr_matrix_type) :: matrices(2), constraints
      real(wp) :: element(24, 24, 2)
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:, :)
      integer :: nodes(3), unknown(24), ix, iy, iz, k, a, b, entries, n, m

      nodes = size + 1
      n = 3*product(nodes)
      m = merge(3*nodes(2)*nodes(3), 0, clamped)
      call element_matrices(element(:, :, 1), element(:, :, 2))
      allocate (row(576*product(size)), column(576*product(size)), value(576*product(size), 2))
      entries = 0
      do ix = 0, size(1) - 1
         do iy = 0, size(2) - 1
            do iz = 0, size(3) - 1
               unknown = [((3*(nodes(3)*(nodes(2)*(ix + ibits(k, 0, 1)) + iy + ibits(k, 1, 1)) + iz + ibits(k, 2, 1)) + a, &
                  a=1, 3), k=0, 7)]
               do a = 1, 24
                  do b = 1, 24
                     entries = entries + 1
                     row(entries) = unknown(a)
                     column(entries) = unknown(b)
                     value(entries, :) = element(a, b, :)
                  end do
               end do
            end do
         end do
      end do
      do k = 1, 2
         call new_csr_from_triplets(matrices(k), n, n, row, column, value(:, k), error)
         if (allocated(error)) return
      end do
      deallocate (row, column, value)
      call new_csr_from_triplets(constraints, m, n, [(k, k=1, m)], [(k, k=1, m)], spread(1.0_wp, 1, m), error)
      if (.not. allocated(error)) call new_modal_problem(problem, matrices(1), matrices(2), error, &
         linear_combination([alpha, beta], matrices), constraints)
   end subroutine build_block

   ! Mass, integrated exactly, and stiffness at two points in each direction.
   pure subroutine element_matrices(mass, stiffness)
      real(wp), intent(out) :: mass(24, 24), stiffness(24, 24)
      real(wp), parameter :: point(2) = [-1, 1]/sqrt(3.0_wp)
      real(wp) :: material(6, 6), strain(6, 24), gradient(3, 8), shape(8), corner(3), at(3)
      integer :: i, k, p

      material = 0
      material(:3, :3) = poisson
      do i = 1, 3
         material(i, i) = 1 - poisson
         material(i + 3, i + 3) = (1 - 2*poisson)/2
      end do
      material = young/((1 + poisson)*(1 - 2*poisson))*material
      mass = 0
      stiffness = 0
      do p = 0, 7
         at = point([(1 + ibits(p, i, 1), i=0, 2)])
         strain = 0
         do k = 1, 8
            corner = [(2.0_wp*ibits(k - 1, i, 1) - 1, i=0, 2)]
            shape(k) = product(1 + corner*at)/8
            do i = 1, 3
               ! Half a metre a unit.
               gradient(i, k) = 2*corner(i)*shape(k)/(1 + corner(i)*at(i))
            end do
            associate (g => gradient(:, k))
               strain(:, 3*k - 2) = [g(1), 0.0_wp, 0.0_wp, g(2), 0.0_wp, g(3)]
               strain(:, 3*k - 1) = [0.0_wp, g(2), 0.0_wp, g(1), g(3), 0.0_wp]
               strain(:, 3*k) = [0.0_wp, 0.0_wp, g(3), 0.0_wp, g(2), g(1)]
            end associate
         end do
         stiffness = stiffness + matmul(transpose(strain), matmul(material, strain))/8
         do k = 1, 8
            do i = 1, 3
               mass(i::3, 3*k - 3 + i) = mass(i::3, 3*k - 3 + i) + density*shape*shape(k)/8
            end do
         end do
      end do
   end subroutine element_matrices
end module solid_block
