!> Which of some names a word was meant to be.
module kschur_suggestion
   implicit none
   private
   public :: did_you_mean

   character(len=*), parameter :: before = "; did you mean ", after = "?"

contains

   pure integer function length_of_ending(word, names) result(length)
      character(len=*), intent(in) :: word, names(:)
      integer :: i

      i = nearest_name(word, names)
      length = 0
      if (i > 0) length = len(before) + len_trim(names(i)) + len(after)
   end function length_of_ending

   !> The end of a message about a word that is none of the names: "; did you mean --modes?", empty where none is near.
   pure function did_you_mean(word, names) result(ending)
      character(len=*), intent(in) :: word
      character(len=*), intent(in) :: names(:)
      character(len=length_of_ending(word, names)) :: ending

      ending = ""
      if (len(ending) > 0) ending = before//trim(names(nearest_name(word, names)))//after
   end function did_you_mean

   ! The place of the name with fewest letters to change, of those with no more than a third of the word's to change or that
   ! begin with it; 0 where there is none.
   pure integer function nearest_name(word, names) result(place)
      character(len=*), intent(in) :: word
      character(len=*), intent(in) :: names(:)
      integer :: i, letters, changes, fewest

      letters = len_trim(word) - verify(word//" ", "-") + 1
      ! A word of which every letter differs is not misspelt.
      fewest = min(max(1, letters/3), letters - 1) + 1
      place = 0
      do i = 1, size(names)
         changes = huge(changes)
         if (abs(len_trim(word) - len_trim(names(i))) < fewest) changes = distance(lower(trim(word)), lower(trim(names(i))))
         if (letters >= 2 .and. index(names(i), trim(word)) == 1) changes = 1
         if (changes >= fewest) cycle
         fewest = changes
         place = i
      end do
   end function nearest_name

   ! Letters to insert, leave out, replace or exchange with their neighbour, each once (optimal string alignment; Boytsov, ACM J.
   ! Exp. Algorithmics 16, 2011).
   pure integer function distance(a, b)
      character(len=*), intent(in) :: a, b
      integer :: d(0:len(a), 0:len(b))
      integer :: i, j

      d(:, 0) = [(i, i=0, len(a))]
      d(0, :) = [(j, j=0, len(b))]
      do j = 1, len(b)
         do i = 1, len(a)
            d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, d(i - 1, j - 1) + merge(0, 1, a(i:i) == b(j:j)))
            if (i > 1 .and. j > 1) then
               if (a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)) &
                  d(i, j) = min(d(i, j), d(max(i - 2, 0), max(j - 2, 0)) + 1)
            end if
         end do
      end do
      distance = d(len(a), len(b))
   end function distance

   pure function lower(word)
      character(len=*), intent(in) :: word
      character(len=len(word)) :: lower
      character(len=*), parameter :: capitals = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
      integer :: i, k

      lower = word
      do i = 1, len(word)
         k = index(capitals, word(i:i))
         if (k > 0) lower(i:i) = achar(iachar("a") + k - 1)
      end do
   end function lower
end module kschur_suggestion
