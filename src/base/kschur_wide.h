/* Four numbers side by side, and what tells whether the processor computes with so many at once: one build serves those that do and
   those that do not. A kernel is written once as INLINE; a WIDE procedure that calls it is for the former, where HAS_WIDE. */
#ifndef KSCHUR_WIDE_H
#define KSCHUR_WIDE_H

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));

#define INLINE static inline __attribute__((always_inline))

#if defined(__x86_64__) && defined(__GNUC__)
#define WIDE __attribute__((target("avx2,fma")))
#define HAS_WIDE (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
#else
#define WIDE
#define HAS_WIDE 0
#endif

#endif
