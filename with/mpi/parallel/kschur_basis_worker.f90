!> Executes requests on distributed bases in processes other than the first, which hold their rows.
module kschur_basis_worker
   use kschur_basis_rows_complex, only: complex_rows_type => basis_rows_type
   use kschur_basis_rows_real, only: real_rows_type => basis_rows_type
   use kschur_block_decomposition, only: block_decomposition_type
   use kschur_basis_requests, only: complex_basis, real_basis, to_release
   use kschur_kinds, only: wp
   use kschur_processes, only: request_length, processes_type
   implicit none
   private
   public :: basis_instance_type, serve_basis

   !> Local rows of one basis.
   type :: basis_instance_type
      !> Its number in the first process.
      integer :: number = 0
      !> The basis; of a block Lanczos decomposition with its other data.
      type(block_decomposition_type), pointer :: decomposition => null()
      type(real_rows_type), pointer :: real => null()
      type(complex_rows_type), pointer :: complex => null()
      !> Local rows of parts of states, for the first level of a two-level basis.
      real(wp), allocatable :: real_parts(:, :)
      complex(wp), allocatable :: complex_parts(:, :)
   end type basis_instance_type

contains

   !> Executes a request of the first process on the local rows of a basis.
   subroutine serve_basis(instances, processes, request)
      !> All bases.
      type(basis_instance_type), allocatable, intent(inout) :: instances(:)
      type(processes_type), target, intent(inout) :: processes
      !> After the code: number and kind of the basis, procedure, and arguments.
      integer, intent(in) :: request(request_length)
      type(basis_instance_type) :: new
      type(processes_type), pointer :: all
      integer :: i

      all => processes
      associate (number => request(2), what => request(4))
         i = findloc(instances%number, number, dim=1)
         if (i == 0) then
            new%number = number
            if (request(3) == real_basis) then
               allocate (new%decomposition)
               new%real => new%decomposition%basis
            end if
            if (request(3) == complex_basis) allocate (new%complex)
            instances = [instances, new]
            i = size(instances)
         end if
         if (what == to_release) then
            if (associated(instances(i)%decomposition)) deallocate (instances(i)%decomposition)
            if (associated(instances(i)%complex)) deallocate (instances(i)%complex)
            instances = pack(instances, instances%number /= number)
         else if (associated(instances(i)%real)) then
            call instances(i)%real%serve(all, request(4:))
         else
            call instances(i)%complex%serve(all, request(4:))
         end if
      end associate
   end subroutine serve_basis
end module kschur_basis_worker
