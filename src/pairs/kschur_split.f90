!> Eigenvalues that cannot be told apart form a cluster: their error discs overlap.
module kschur_split
   use kschur_kinds, only: wp
   implicit none
   private
   public :: cluster_type, match_conjugates, new_cluster, split

   !> Members of a list whose eigenvalues are told apart, if at all, only together.
   type :: cluster_type
      !> Their positions in the list, ascending.
      integer, allocatable :: members(:)
      !> Middle of their eigenvalues (1/s), real where the cluster meets the real axis.
      complex(wp) :: centre = (0.0_wp, 0.0_wp)
      !> How far they are from it (1/s), without and with their discs.
      real(wp) :: spread = 0, radius = 0
      !> The nearest other eigenvalue of the list (1/s), conjugates included.
      real(wp) :: gap = huge(1.0_wp)
      !> Whether a disc meets the real axis: conjugates belong to the cluster then, and its space has a real basis.
      logical :: on_axis = .false.
   contains
      !> Whether an eigenvalue lies where those of the members do.
      procedure :: holds
      !> Makes it as wide as its neighbours, and a relative distance, allow.
      procedure :: widen
   end type cluster_type

contains

   !> The clusters of a list of eigenvalues: chains of overlapping discs.
   pure subroutine split(lambda, discs, clusters, most)
      complex(wp), intent(in) :: lambda(:)
      !> Radius of each disc (1/s).
      real(wp), intent(in) :: discs(:)
      type(cluster_type), allocatable, intent(out) :: clusters(:)
      !> A cluster is solved for as one dense problem: it has no more members than this; absent: than a hundred.
      integer, optional, intent(in) :: most
      integer :: label(size(lambda)), members(size(lambda)), labels, reached, inside, limit, i, j

      limit = 100
      if (present(most)) limit = most
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
         clusters(j) = new_cluster(lambda, discs, pack([(i, i=1, size(lambda))], label == j))
      end do
   end subroutine split

   !> The cluster of some members.
   pure function new_cluster(lambda, discs, members) result(cluster)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: discs(:)
      integer, intent(in) :: members(:)
      type(cluster_type) :: cluster
      logical :: others(size(lambda))

      allocate (cluster%members, source=members)
      associate (values => lambda(members))
         cluster%on_axis = any(abs(aimag(values)) <= discs(members))
         cluster%centre = sum(values)/size(members)
         if (cluster%on_axis) cluster%centre = real(cluster%centre, wp)
         cluster%spread = maxval(abs(values - cluster%centre))
         cluster%radius = maxval(abs(values - cluster%centre) + discs(members))
      end associate
      others = .true.
      others(members) = .false.
      associate (centre => cluster%centre)
         cluster%gap = min(minval(abs(lambda - centre), others), minval(abs(conjg(lambda) - centre), others))
         if (.not. cluster%on_axis) cluster%gap = min(cluster%gap, 2*abs(aimag(centre)))
      end associate
   end function new_cluster

   !> Of a real problem, eigenvalues below the real axis that mirror others of the list above it are the same modes. Each
   !> mirrors one, so that copies stay as many as there are. Next to the axis both may be real, and stay, unless one is exactly
   !> the conjugate of the other.
   pure subroutine match_conjugates(lambda, discs, paired, mirrored)
      complex(wp), intent(in) :: lambda(:)
      real(wp), intent(in) :: discs(:)
      !> Which stand for themselves and their conjugates; those that are mirrored do now.
      logical, intent(inout) :: paired(:)
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

   subroutine widen(self, distance)
      class(cluster_type), intent(inout) :: self
      real(wp), intent(in) :: distance

      self%radius = max(self%radius, min(self%gap/2, distance*abs(self%centre)))
   end subroutine widen

   elemental logical function holds(self, lambda)
      class(cluster_type), intent(in) :: self
      complex(wp), intent(in) :: lambda

      holds = abs(lambda - self%centre) <= self%radius
   end function holds
end module kschur_split
