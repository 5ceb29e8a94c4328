/* SIGINT and SIGTERM are for the main thread: they are held before there is another one, so that those that libraries make,
 * OpenBLAS while it is loaded and MPI when it begins, leave them to it. METIS, while it orders, takes SIGTERM for itself and jumps from
 * its handler to where it was called, which in another thread than its own is nowhere. `let_signals` ends it in the main thread.
 * Only a program can do something before its libraries are loaded, by a section of ELF. */
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
