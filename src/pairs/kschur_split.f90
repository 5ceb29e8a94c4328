!> Clusters of eigenvalues: sets whose error discs overlap, so that their members are not resolved.
module kschur_split
   use kschur_kinds, only: wp
   implicit none
   private
   public :: cluster_type, match_conjugates, new_cluster, split

   !> A cluster: members of a list whose eigenvalues can only be resolved together, from one invariant subspace.
   type :: cluster_type
      !> Their positions in the list, ascending.
      integer, allocatable :: members(:)
      !> Middle of their eigenvalues (1/s), real where the cluster meets the real axis.
      complex(wp) :: centre = (0.0_wp, 0.0_wp)
      !> The largest distance of a member from the centre (1/s), without and with its disc.
      real(wp) :: spread = 0, radius = 0
      !> The largest disc of a member (1/s); 0 if a shift inside of it is tried first.
      real(wp) :: disc = 0
      !> The distance of the nearest other eigenvalue of the list from the centre (1/s), conjugates included if they are any.
      real(wp) :: gap = huge(1.0_wp)
      !> Whether the disc of a member meets the real axis: conjugates belong to the cluster then, and its space has a real basis.
      !> Not with losses.
      logical :: on_axis = .false.
   contains
      !> Increases the radius to a relative distance, limited to half of the gap.
      procedure :: widen
      !> Counts the eigenvalues of a list, both of a conjugate pair if the cluster meets the real axis.
      procedure :: count_eigenvalues
   end type cluster_type

contains

   !> Splits a list of eigenvalues into clusters: the connected components of the relation that an eigenvalue lies in the disc of
   !> another one.
   pure subroutine split(lambda, discs, clusters, max_members, lossy)
      complex(wp), intent(in) :: lambda(:)
      !> Radius of each disc (1/s).
      real(wp), intent(in) :: discs(:)
      type(cluster_type), allocatable, intent(out) :: clusters(:)
      !> Largest number of members of a cluster, as it is solved as one dense problem. Absent: 100.
      integer, optional, intent(in) :: max_members
      !> Whether the problem has losses: conjugates are no eigenvalues then. Absent: not.
      logical, optional, intent(in) :: lossy
      integer :: label(size(lambda)), members(size(lambda)), labels, reached, inside, limit, i, j

      limit = 100
      if (present(max_members)) limit = max_members
      label = 0
      labels = 0
      do j = 1, size(lambda)
         if (label(j) > 0) cycle
         labels = labels + 1
         members(1) = j
         label(j) = labels
         inside = 1
         reached = 0
         do while (reached < inside)
            reached = reached + 1
            do i = j + 1, size(lambda)
               if (inside == limit) exit
               associate (l => members(reached))
                  if (label(i) > 0 .or. abs(lambda(i) - lambda(l)) > max(discs(i), discs(l))) cycle
               end associate
               inside = inside + 1
               members(inside) = i
               label(i) = labels
            end do
         end do
      end do
      allocate (clusters(labels))
      do j = 1, labels
         clusters(j) = new_cluster(lambda, discs, pack([(i, i=1, size(lambda))], label == j), lossy)
      end do
   end subroutine split

   !> Makes the cluster of given members of a list.
   pure function new_cluster(lambda, discs, members, lossy) result(cluster)
      complex(wp), intent(in) :: lambda(:)
      !> Radius of each disc (1/s).
      real(wp), intent(in) :: discs(:)
      !> Positions in the list.
      integer, intent(in) :: members(:)
      !> As for `split`.
      logical, optional, intent(in) :: lossy
      type(cluster_type) :: cluster
      logical :: others(size(lambda)), has_conjugates

      has_conjugates = .true.
      if (present(lossy)) has_conjugates = .not. lossy
      allocate (cluster%members, source=members)
      associate (values => lambda(members))
         cluster%on_axis = has_conjugates .and. any(abs(aimag(values)) <= discs(members))
         cluster%centre = sum(values)/size(members)
         if (cluster%on_axis) cluster%centre = real(cluster%centre, wp)
         cluster%spread = maxval(abs(values - cluster%centre))
         cluster%radius = maxval(abs(values - cluster%centre) + discs(members))
         cluster%disc = maxval(discs(members))
      end associate
      others = .true.
      others(members) = .false.
      associate (centre => cluster%centre)
         cluster%gap = minval(abs(lambda - centre), others)
         if (has_conjugates) cluster%gap = min(cluster%gap, minval(abs(conjg(lambda) - centre), others))
         if (has_conjugates .and. .not. cluster%on_axis) cluster%gap = min(cluster%gap, 2*abs(aimag(centre)))
      end associate
   end function new_cluster

   !> Finds eigenvalues of a real problem below the real axis that are the conjugates of others of the list above it: they are the
   !> same modes. Each is matched with one, so that the number of copies is preserved. Next to the axis two eigenvalues may both be
   !> real: they are matched only if one is exactly the conjugate of the other.
   pure subroutine match_conjugates(lambda, discs, paired, mirrored)
      complex(wp), intent(in) :: lambda(:)
      !> Radius of each disc (1/s).
      real(wp), intent(in) :: discs(:)
      !> Which stand for themselves and their conjugates; set for those whose conjugate was found.
      logical, intent(inout) :: paired(:)
      !> Which are conjugates of others, to be dropped.
      logical, intent(out) :: mirrored(:)
      logical :: upper(size(lambda))
      real(wp) :: distance
      integer :: i, j

      mirrored = .false.
      upper = aimag(lambda) > 0 .and. .not. paired
      do j = 1, size(lambda)
         if (.not. aimag(lambda(j)) < 0 .or. paired(j) .or. .not. any(upper)) cycle
         i = minloc(abs(lambda - conjg(lambda(j))), 1, upper)
         distance = abs(lambda(i) - conjg(lambda(j)))
         if (distance > 0 .and. (abs(aimag(lambda(j))) <= discs(j) .or. distance > max(discs(i), discs(j)))) cycle
         mirrored(j) = .true.
         upper(i) = .false.
         paired(i) = .true.
      end do
   end subroutine match_conjugates

   !> Increases the radius to a distance relative to the centre, limited to half of the gap.
   subroutine widen(self, distance)
      class(cluster_type), intent(inout) :: self
      real(wp), intent(in) :: distance

      self%radius = max(self%radius, min(self%gap/2, distance*abs(self%centre)))
   end subroutine widen

   pure integer function count_eigenvalues(self, lambda)
      class(cluster_type), intent(in) :: self
      complex(wp), intent(in) :: lambda(:)

      count_eigenvalues = size(lambda)
      if (self%on_axis) count_eigenvalues = count_eigenvalues + count(abs(aimag(lambda)) > 0)
   end function count_eigenvalues
end module kschur_split
