/* Advises the system to map memory in huge pages before it is first used: with pages of 4 KiB each step from column to column
   of a long basis misses the TLB. Failure has no effect but speed. */
#define _DEFAULT_SOURCE
#include <stddef.h>
#include <stdint.h>
#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

void kschur_prefer_large_pages(void *first, double bytes)
{
#if defined(MADV_HUGEPAGE)
   uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
   uintptr_t begin = ((uintptr_t)first + page - 1)/page*page;
   uintptr_t end = ((uintptr_t)first + (uintptr_t)bytes)/page*page;

   if (begin < end) madvise((void *)begin, (size_t)(end - begin), MADV_HUGEPAGE);
#else
   (void)first;
   (void)bytes;
#endif
}
