/* How many solves of a process share its cores, and how many threads its BLAS has meanwhile: Fortran 2008 has no
 * atomic counter, and only OpenBLAS, where it is there, says how to set that. */
#include <pthread.h>

#ifdef __GNUC__
#define MAY_BE_MISSING __attribute__((weak))
extern void openblas_set_num_threads(int threads) MAY_BE_MISSING;
extern int openblas_get_num_threads(void) MAY_BE_MISSING;
#define HAS_OPENBLAS (openblas_set_num_threads && openblas_get_num_threads)
#else
#define HAS_OPENBLAS 0
static void openblas_set_num_threads(int threads) { (void)threads; }
static int openblas_get_num_threads(void) { return 1; }
#endif

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static int solves = 0;
static int blas_threads_before = 1;
/* A solve within a solve of the same thread shares what that has. */
static __thread int depth = 0;

/* Counts one solve more, and says how many there are; 0 within another one of this thread. The BLAS has one thread as
 * long as there are any. */
int kschur_enter_solve(void)
{
   int now;

   if (depth++ > 0) return 0;
   pthread_mutex_lock(&mutex);
   now = ++solves;
   if (now == 1 && HAS_OPENBLAS) {
      blas_threads_before = openblas_get_num_threads();
      if (blas_threads_before != 1) openblas_set_num_threads(1);
   }
   pthread_mutex_unlock(&mutex);
   return now;
}

void kschur_leave_solve(void)
{
   if (--depth > 0) return;
   pthread_mutex_lock(&mutex);
   if (--solves == 0 && HAS_OPENBLAS && blas_threads_before != 1) openblas_set_num_threads(blas_threads_before);
   pthread_mutex_unlock(&mutex);
}

/* Threads of the BLAS: more than one only where nobody else is using it. */
void kschur_set_blas_threads(int threads)
{
   pthread_mutex_lock(&mutex);
   if ((solves == 1 || (solves > 1 && threads == 1)) && HAS_OPENBLAS && openblas_get_num_threads() != threads)
      openblas_set_num_threads(threads);
   pthread_mutex_unlock(&mutex);
}
