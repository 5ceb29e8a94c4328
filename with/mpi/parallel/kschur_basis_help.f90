!> What the other processes do of the bases that the first one has: their rows.
module kschur_basis_help
   use kschur_basis_rows_complex, only: complex_rows_type => basis_rows_type
   use kschur_basis_rows_real, only: real_rows_type => basis_rows_type
   use kschur_block_decomposition, only: block_decomposition_type
   use kschur_basis_words, only: complex_basis, real_basis, to_release
   use kschur_kinds, only: wp
   use kschur_processes, only: number_of_words, processes_type
   implicit none
   private
   public :: basis_instance_type, help_basis

   !> The rows of one basis that are here.
   type :: basis_instance_type
      !> As the first process counts them.
      integer :: number = 0
      !> A real basis, with what else is here where it is that of a block Lanczos decomposition.
      type(block_decomposition_type), pointer :: decomposition => null()
      type(real_rows_type), pointer :: real => null()
      type(complex_rows_type), pointer :: complex => null()
      !> Rows of parts of states, where it is the first level of a two-level basis.
      real(wp), allocatable :: real_parts(:, :)
      complex(wp), allocatable :: complex_parts(:, :)
   end type basis_instance_type

contains

   !> Does what the first process has called.
   subroutine help_basis(instances, processes, words)
      !> The bases that there are.
      type(basis_instance_type), allocatable, intent(inout) :: instances(:)
      type(processes_type), target, intent(inout) :: processes
      !> Number and kind of the basis, the procedure and its arguments, after the first word.
      integer, intent(in) :: words(number_of_words)
      type(basis_instance_type) :: new
      type(processes_type), pointer :: all
      integer :: i

      all => processes
      associate (number => words(2), what => words(4))
         i = findloc(instances%number, number, dim=1)
         if (i == 0) then
            new%number = number
            if (words(3) == real_basis) then
               allocate (new%decomposition)
               new%real => new%decomposition%basis
            end if
            if (words(3) == complex_basis) allocate (new%complex)
            instances = [instances, new]
            i = size(instances)
         end if
         if (what == to_release) then
            if (associated(instances(i)%decomposition)) deallocate (instances(i)%decomposition)
            if (associated(instances(i)%complex)) deallocate (instances(i)%complex)
            instances = pack(instances, instances%number /= number)
         else if (associated(instances(i)%real)) then
            call instances(i)%real%help_with(all, words(4:))
         else
            call instances(i)%complex%help_with(all, words(4:))
         end if
      end associate
   end subroutine help_basis
end module kschur_basis_help
