/* Blocks SIGINT and SIGTERM before libraries start threads, which inherit the block: OpenBLAS does while it is loaded, MPI when
 * it begins. `let_signals` unblocks both in the main thread, which alone receives them then. METIS, while it orders, handles
 * SIGTERM by a jump to where it was called, which is valid in its own thread only. A program runs code before its libraries are
 * loaded by the ELF section .preinit_array, a library cannot. */
#define _XOPEN_SOURCE 700
#include <signal.h>
#include <stddef.h>

#ifdef __ELF__
static void hold_signals(void)
{
   sigset_t both;

   sigemptyset(&both);
   sigaddset(&both, SIGINT);
   sigaddset(&both, SIGTERM);
   sigprocmask(SIG_BLOCK, &both, NULL);
}

__attribute__((section(".preinit_array"), used)) static void (*const before_libraries)(void) = hold_signals;
#endif
