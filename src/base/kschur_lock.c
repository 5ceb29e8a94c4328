/* The mutexes of kschur_lock: Fortran 2008 has none. */
#define _XOPEN_SOURCE 700
#include <pthread.h>
#include <signal.h>

enum { locks = 5 };

static pthread_once_t once = PTHREAD_ONCE_INIT;
static pthread_mutex_t mutexes[locks];
static sigset_t signals_before;

/* Error-checking mutexes: a thread that takes a lock twice gets an error instead of a deadlock. */
static void prepare(void)
{
   pthread_mutexattr_t attributes;

   pthread_mutexattr_init(&attributes);
   pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_ERRORCHECK);
   for (int i = 0; i < locks; i++) pthread_mutex_init(&mutexes[i], &attributes);
   pthread_mutexattr_destroy(&attributes);
}

/* Waits for a lock and takes it. Returns nonzero, without waiting, if this thread holds it already. */
int kschur_acquire_lock(int lock)
{
   pthread_once(&once, prepare);
   return pthread_mutex_lock(&mutexes[lock]);
}

void kschur_release_lock(int lock)
{
   pthread_mutex_unlock(&mutexes[lock]);
}

/* Blocks SIGTERM in the calling thread. */
void kschur_hold_sigterm(void)
{
   sigset_t term;

   sigemptyset(&term);
   sigaddset(&term, SIGTERM);
   pthread_sigmask(SIG_BLOCK, &term, &signals_before);
}

/* Restores the signal mask of before kschur_hold_sigterm. Call both under the lock of METIS, as one mask is stored. */
void kschur_let_sigterm(void)
{
   pthread_sigmask(SIG_SETMASK, &signals_before, NULL);
}
