/* What memory the system has, and by a trial mapping whether it grants some. The mapping is not touched: Linux assigns
 * pages only at the first access. And what malloc keeps goes back to the system. */
#define _DEFAULT_SOURCE
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#if defined(__unix__) || defined(__APPLE__)
#include <sys/mman.h>
#include <unistd.h>
#endif
#ifdef __GLIBC__
#include <malloc.h>
#endif

/* Returns whether `bytes` bytes of address space can be mapped now. */
int kschur_can_have(double bytes)
{
   void *room;

   if (!(bytes < (double)(SIZE_MAX/2))) return 0;
#if defined(__unix__) || defined(__APPLE__)
   /* Not by malloc, which learns from what is freed and would keep it. */
   room = mmap(NULL, (size_t)bytes + 1, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
   if (room == MAP_FAILED) return 0;
   munmap(room, (size_t)bytes + 1);
#else
   room = malloc((size_t)bytes + 1);
   if (room == NULL) return 0;
   free(room);
#endif
   return 1;
}

/* Returns the bytes of memory of this machine; 0 where the system does not tell. */
double kschur_machine_memory(void)
{
#if defined(_SC_PHYS_PAGES) && defined(_SC_PAGESIZE)
   long pages = sysconf(_SC_PHYS_PAGES), bytes = sysconf(_SC_PAGESIZE);

   if (pages > 0 && bytes > 0) return (double)pages*(double)bytes;
#endif
   return 0;
}

/* Returns to the system the pages of memory that has been freed. malloc keeps them for what fits between. */
void kschur_return_memory(void)
{
#ifdef __GLIBC__
   malloc_trim(0);
#endif
}
