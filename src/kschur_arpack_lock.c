/* ARPACK keeps the state of an iteration in variables of its own, one set for the whole process.
   Whoever iterates with it holds this lock from the first call to the last; others wait. */
#include <pthread.h>

static pthread_mutex_t arpack = PTHREAD_MUTEX_INITIALIZER;

void kschur_arpack_lock(void)
{
    pthread_mutex_lock(&arpack);
}

void kschur_arpack_unlock(void)
{
    pthread_mutex_unlock(&arpack);
}
