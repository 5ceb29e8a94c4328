/* ARPACK keeps the state of an iteration in variables of its own, one set for the whole process.
   Whoever iterates with it holds this lock from the first call to the last; other threads wait. */
#define _XOPEN_SOURCE 700
#include <pthread.h>

static pthread_once_t once = PTHREAD_ONCE_INIT;
static pthread_mutex_t arpack;

/* A thread that takes the lock twice is told so instead of waiting for itself. */
static void prepare(void)
{
    pthread_mutexattr_t attributes;

    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_ERRORCHECK);
    pthread_mutex_init(&arpack, &attributes);
    pthread_mutexattr_destroy(&attributes);
}

/* 0, or another number where the thread holds the lock already. */
int kschur_arpack_lock(void)
{
    pthread_once(&once, prepare);
    return pthread_mutex_lock(&arpack);
}

void kschur_arpack_unlock(void)
{
    pthread_mutex_unlock(&arpack);
}
