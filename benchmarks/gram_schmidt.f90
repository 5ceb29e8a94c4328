!> One step of Gram-Schmidt on a two-level basis: readings of the basis one by one, and those that share a panel in the cache.
!>
!>     benchmark_gram_schmidt [ROWS]
!>
!> Two passes, the last update and the two parts of the next vector. The least of several times, in milliseconds, and the
!> basis divided by the time.
program gram_schmidt
   use kschur, only: wp
   use kschur_clock, only: clock, seconds_since
   use kschur_kinds, only: long
   use kschur_random, only: random_vector
   use kschur_tall_products_real, only: complete_and_combine, form_combinations, inner_products, project_again, &
      subtract_combinations
   use kschur_threads, only: team_size
   implicit none
   integer, parameter :: columns(4) = [20, 80, 160, 320], repetitions = 25
   real(wp), allocatable :: v(:, :), c(:, :), a(:, :), x(:, :)
   real(wp) :: separate, shared, gigabytes
   character(len=20) :: word
   integer(long) :: state
   integer :: n, i, j, k

   n = 77808
   call get_command_argument(1, word)
   if (len_trim(word) > 0) read (word, *) n
   allocate (v(n, maxval(columns) + 1), x(n, 2))
   state = 1
   do j = 1, size(v, 2)
      call random_vector(state, v(:, j))
   end do
   v = v/norm2(v(:, 1))
   print "(i0, a, i0, a)", n, " rows, ", team_size(), " threads"
   print "(a)", "| columns | one by one, ms | GB/s | shared, ms | GB/s |"
   print "(a)", "|---:|---:|---:|---:|---:|"
   do i = 1, size(columns)
      k = columns(i)
      allocate (c(k, 1), a(k + 1, 2))
      a = v(:k + 1, :2)
      separate = huge(1.0_wp)
      shared = huge(1.0_wp)
      do j = 1, repetitions
         separate = min(separate, seconds_one_by_one())
         shared = min(shared, seconds_shared())
      end do
      gigabytes = 8.0e-9_wp*n*k
      print "('| ', i0, 2(' | ', f0.2, ' | ', f0.1), ' |')", k, 1000*separate, gigabytes/separate, 1000*shared, gigabytes/shared
      deallocate (c, a)
   end do

contains

   real(wp) function seconds_one_by_one() result(seconds)
      integer(long) :: started
      integer :: pass

      started = clock()
      do pass = 1, 2
         call inner_products(v, v(:, k + 1:k + 1), c)
         call subtract_combinations(v(:, :k), c, v(:, k + 1:k + 1))
      end do
      call form_combinations(v, a, x)
      seconds = seconds_since(started)
   end function seconds_one_by_one

   real(wp) function seconds_shared() result(seconds)
      integer(long) :: started

      started = clock()
      call inner_products(v, v(:, k + 1:k + 1), c)
      call project_again(v(:, :k), c(:, 1), v(:, k + 1), a(:k, 1))
      call complete_and_combine(v, a(:k, 1), 1.0_wp, a, x)
      seconds = seconds_since(started)
   end function seconds_shared
end program gram_schmidt
