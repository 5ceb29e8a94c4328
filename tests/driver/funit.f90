!> What a .pf file gets from `use funit` where pFUnit is not installed.
module funit
   use funit_cases
   use funit_conditions
   use funit_core, only: SourceLocation, anyExceptions
   use funit_equal_complex
   use funit_equal_int32
   use funit_equal_int32_int64
   use funit_equal_int32_real
   use funit_equal_int64
   use funit_equal_real
   use funit_greater_equal_int32
   use funit_greater_equal_int64
   use funit_greater_equal_real
   use funit_greater_int32
   use funit_greater_int64
   use funit_greater_real
   use funit_less_equal_int32
   use funit_less_equal_int64
   use funit_less_equal_real
   use funit_less_int32
   use funit_less_int64
   use funit_less_real
   use funit_relatively_equal
   implicit none
   public
end module funit
