!> Writes modes of a result as files for ParaView.
module kschur_view
   use kschur_error, only: error_type, add_context, new_error, error_usage
   use kschur_files, only: make_folder, require_space, staging_type
   use kschur_kinds, only: long, wp
   use kschur_mesh, only: mesh_type
   use kschur_result, only: modal_result_type
   use kschur_text, only: text
   use kschur_vtu, only: largest_displacement, write_pvd, write_vtu, write_vtu_frame
   implicit none
   private
   public :: write_view

   !> Largest number of frames of a period.
   integer, parameter, public :: most_frames = 10000
   integer, parameter :: name_length = 40

contains

   !> Writes for selected modes the mode shape (as mode_3.vtu), one period of its motion (mode_3.pvd with frames), and all
   !> motions in sequence (modes.pvd). Fails if the problem has no mesh, or the folder cannot be written; all files appear when
   !> all are complete.
   subroutine write_view(result, modes, frames, amplitude, folder, error)
      type(modal_result_type), intent(in) :: result
      !> Positions of modes, from 1.
      integer, intent(in) :: modes(:)
      !> Frames of a period; 0: no motion.
      integer, intent(in) :: frames
      !> Largest displacement in the frames, relative to the size of the structure.
      real(wp), intent(in) :: amplitude
      character(len=*), intent(in) :: folder
      type(error_type), allocatable, intent(out) :: error
      type(staging_type) :: staging
      character(len=name_length) :: names(size(modes)), files(size(modes))
      integer :: k

      if (frames < 0 .or. frames > most_frames) then
         call new_error(error, error_usage, "a period has from 0 to "//text(most_frames)//" frames, not "//text(frames))
         return
      end if
      if (.not. allocated(result%mesh)) then
         call new_error(error, error_usage, "the problem did not say where its unknowns stand: it needs /coordinates")
         return
      end if
      call staging%open(folder, error)
      if (.not. allocated(error)) call make_folder(staging%path)
      do k = 1, size(modes)
         names(k) = "mode_"//text(modes(k))
         files(k) = trim(names(k))//".vtu"
         call write_vtu(result%mesh, result%eigenvectors(:, modes(k):modes(k)), names(k:k), &
            staging%path//"/"//trim(files(k)), error)
         if (frames > 0) call write_motion(result%mesh, result%eigenvectors(:, modes(k)), frames, amplitude, &
            staging%path, trim(names(k)), size(modes) - k + 1, error)
      end do
      call write_pvd(files, real(modes, wp), staging%path//"/modes.pvd", error)
      call staging%finish(error)
      call add_context(error, folder)
   end subroutine write_view

   ! Writes the frames of one period of a mode, and their time series.
   subroutine write_motion(mesh, shape, frames, amplitude, folder, name, motions, error)
      type(mesh_type), intent(in) :: mesh
      complex(wp), intent(in) :: shape(:)
      integer, intent(in) :: frames
      real(wp), intent(in) :: amplitude
      character(len=*), intent(in) :: folder, name
      !> Number of such motions, for the estimate of disk space.
      integer, intent(in) :: motions
      type(error_type), allocatable, intent(inout) :: error
      complex(wp), parameter :: i = (0.0_wp, 1.0_wp)
      real(wp), parameter :: two_pi = 8*atan(1.0_wp)
      complex(wp), allocatable :: moved(:, :)
      character(len=name_length) :: files(frames)
      real(wp) :: extent
      integer(long) :: bytes
      integer :: k

      if (allocated(error)) return
      call mesh%displacements(shape, moved)
      extent = norm2(maxval(mesh%coordinates, 2) - minval(mesh%coordinates, 2))
      if (largest_displacement(moved) > 0) &
         moved = moved*(amplitude*merge(extent, 1.0_wp, extent > 0)/largest_displacement(moved))
      do k = 1, frames
         files(k) = name//"_"//text(k)//".vtu"
         call write_vtu_frame(mesh, real(exp(i*two_pi*(k - 1)/frames)*moved, wp), folder//"/"//trim(files(k)), error)
         if (allocated(error)) return
         ! Frames differ in length by a few digits.
         if (k == 1) inquire (file=folder//"/"//trim(files(k)), size=bytes)
         if (k == 1) call require_space(folder, bytes*(int(frames, long)*motions - 1), error)
      end do
      call write_pvd(files, [(real(k - 1, wp)/frames, k=1, frames)], folder//"/"//name//".pvd", error)
   end subroutine write_motion
end module kschur_view
