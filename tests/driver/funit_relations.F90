! The assertions which compare two values, one module for each pair of types.

module funit_equal_int32
#define ASSERTION assertEqual
#define EXPECTED_TYPE integer(int32)
#define ACTUAL_TYPE integer(int32)
#define RELATION expected == actual
#define BUT 'but found'
#include "relation.inc"
end module funit_equal_int32

module funit_equal_int64
#define ASSERTION assertEqual
#define EXPECTED_TYPE integer(int64)
#define ACTUAL_TYPE integer(int64)
#define RELATION expected == actual
#define BUT 'but found'
#include "relation.inc"
end module funit_equal_int64

module funit_equal_int32_int64
#define ASSERTION assertEqual
#define EXPECTED_TYPE integer(int32)
#define ACTUAL_TYPE integer(int64)
#define RELATION expected == actual
#define BUT 'but found'
#include "relation.inc"
end module funit_equal_int32_int64

module funit_equal_real
#define ASSERTION assertEqual
#define EXPECTED_TYPE real(real64)
#define ACTUAL_TYPE real(real64)
#define RELATION within(expected, actual, bound)
#define BUT 'but found'
#define TOLERANT
#include "relation.inc"
end module funit_equal_real

module funit_equal_int32_real
#define ASSERTION assertEqual
#define EXPECTED_TYPE integer(int32)
#define ACTUAL_TYPE real(real64)
#define RELATION within(expected, actual, bound)
#define BUT 'but found'
#define TOLERANT
#include "relation.inc"
end module funit_equal_int32_real

module funit_equal_complex
#define ASSERTION assertEqual
#define EXPECTED_TYPE complex(real64)
#define ACTUAL_TYPE complex(real64)
#define RELATION within(expected, actual, bound)
#define BUT 'but found'
#define TOLERANT
#include "relation.inc"
end module funit_equal_complex

module funit_relatively_equal
#define ASSERTION assertRelativelyEqual
#define EXPECTED_TYPE real(real64)
#define ACTUAL_TYPE real(real64)
#define RELATION abs(expected) > 0 .and. within(expected, actual, bound*abs(expected))
#define BUT 'but relatively found'
#define TOLERANT
#include "relation.inc"
end module funit_relatively_equal

module funit_less_int32
#define ASSERTION assertLessThan
#define EXPECTED_TYPE integer(int32)
#define ACTUAL_TYPE integer(int32)
#define RELATION expected < actual
#define BUT 'to be less than'
#include "relation.inc"
end module funit_less_int32

module funit_less_int64
#define ASSERTION assertLessThan
#define EXPECTED_TYPE integer(int64)
#define ACTUAL_TYPE integer(int64)
#define RELATION expected < actual
#define BUT 'to be less than'
#include "relation.inc"
end module funit_less_int64

module funit_less_real
#define ASSERTION assertLessThan
#define EXPECTED_TYPE real(real64)
#define ACTUAL_TYPE real(real64)
#define RELATION expected < actual
#define BUT 'to be less than'
#include "relation.inc"
end module funit_less_real

module funit_less_equal_int32
#define ASSERTION assertLessThanOrEqual
#define EXPECTED_TYPE integer(int32)
#define ACTUAL_TYPE integer(int32)
#define RELATION expected <= actual
#define BUT 'to be at most'
#include "relation.inc"
end module funit_less_equal_int32

module funit_less_equal_int64
#define ASSERTION assertLessThanOrEqual
#define EXPECTED_TYPE integer(int64)
#define ACTUAL_TYPE integer(int64)
#define RELATION expected <= actual
#define BUT 'to be at most'
#include "relation.inc"
end module funit_less_equal_int64

module funit_less_equal_real
#define ASSERTION assertLessThanOrEqual
#define EXPECTED_TYPE real(real64)
#define ACTUAL_TYPE real(real64)
#define RELATION expected <= actual
#define BUT 'to be at most'
#include "relation.inc"
end module funit_less_equal_real

module funit_greater_int32
#define ASSERTION assertGreaterThan
#define EXPECTED_TYPE integer(int32)
#define ACTUAL_TYPE integer(int32)
#define RELATION expected > actual
#define BUT 'to be greater than'
#include "relation.inc"
end module funit_greater_int32

module funit_greater_int64
#define ASSERTION assertGreaterThan
#define EXPECTED_TYPE integer(int64)
#define ACTUAL_TYPE integer(int64)
#define RELATION expected > actual
#define BUT 'to be greater than'
#include "relation.inc"
end module funit_greater_int64

module funit_greater_real
#define ASSERTION assertGreaterThan
#define EXPECTED_TYPE real(real64)
#define ACTUAL_TYPE real(real64)
#define RELATION expected > actual
#define BUT 'to be greater than'
#include "relation.inc"
end module funit_greater_real

module funit_greater_equal_int32
#define ASSERTION assertGreaterThanOrEqual
#define EXPECTED_TYPE integer(int32)
#define ACTUAL_TYPE integer(int32)
#define RELATION expected >= actual
#define BUT 'to be at least'
#include "relation.inc"
end module funit_greater_equal_int32

module funit_greater_equal_int64
#define ASSERTION assertGreaterThanOrEqual
#define EXPECTED_TYPE integer(int64)
#define ACTUAL_TYPE integer(int64)
#define RELATION expected >= actual
#define BUT 'to be at least'
#include "relation.inc"
end module funit_greater_equal_int64

module funit_greater_equal_real
#define ASSERTION assertGreaterThanOrEqual
#define EXPECTED_TYPE real(real64)
#define ACTUAL_TYPE real(real64)
#define RELATION expected >= actual
#define BUT 'to be at least'
#include "relation.inc"
end module funit_greater_equal_real
