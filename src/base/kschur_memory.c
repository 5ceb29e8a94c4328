/* Checks by a trial mapping whether the system grants memory. The mapping is not touched: Linux assigns pages only at the
 * first access. */
#define _DEFAULT_SOURCE
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#if defined(__unix__) || defined(__APPLE__)
#include <sys/mman.h>
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
