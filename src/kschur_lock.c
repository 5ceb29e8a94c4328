/* The mutexes of kschur_lock: Fortran 2008 has none. */
#include <pthread.h>

static pthread_mutex_t mutexes[5] = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_MUTEX_INITIALIZER, PTHREAD_MUTEX_INITIALIZER,
                                     PTHREAD_MUTEX_INITIALIZER, PTHREAD_MUTEX_INITIALIZER};

void kschur_acquire_lock(int lock)
{
   pthread_mutex_lock(&mutexes[lock]);
}

void kschur_release_lock(int lock)
{
   pthread_mutex_unlock(&mutexes[lock]);
}
