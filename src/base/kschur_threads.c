/* Counts the concurrent solves of a process and sets the number of threads of its BLAS meanwhile. In C because Fortran 2008
 * has no atomic counter; of the BLAS libraries only OpenBLAS is known here. */
#define _XOPEN_SOURCE 700
#include <pthread.h>
#include <signal.h>
#include <stddef.h>
#include <stdlib.h>

extern int kschur_can_have(double bytes);

#ifdef __GNUC__
#define MAY_BE_MISSING __attribute__((weak))
extern void openblas_set_num_threads(int threads) MAY_BE_MISSING;
extern int openblas_get_num_threads(void) MAY_BE_MISSING;
extern void *blas_memory_alloc(int unused) MAY_BE_MISSING;
extern void blas_memory_free(void *buffer) MAY_BE_MISSING;
#define HAS_OPENBLAS (openblas_set_num_threads && openblas_get_num_threads)
#define HAS_BUFFERS (blas_memory_alloc && blas_memory_free)
#else
#define HAS_OPENBLAS 0
#define HAS_BUFFERS 0
static void *blas_memory_alloc(int unused) { (void)unused; return NULL; }
static void blas_memory_free(void *buffer) { (void)buffer; }
static void openblas_set_num_threads(int threads) { (void)threads; }
static int openblas_get_num_threads(void) { return 1; }
#endif

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static int solves = 0;
static int blas_threads_before = 1;
/* Bytes: largest buffer that OpenBLAS maps for a thread inside it; stack and heap of a thread; memory that must remain after
 * the first thread, and after each further one. */
static const double buffer_bytes = 135e6, thread_bytes = 80e6, left_bytes = 32e6, plenty_bytes = 512e6;
/* Number of threads whose buffers and stacks have been checked, and its limit. */
enum { most_prepared = 64 };
static int prepared = 0;
/* Nesting depth: a nested solve uses the threads of the outer one. */
static __thread int depth = 0;

/* Increments the number of concurrent solves and returns it; 0 for a solve nested in one of the same thread. The BLAS is
 * limited to one thread while there are any. */
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

/* Decrements the number of concurrent solves; after the last one the BLAS gets back its threads. */
void kschur_leave_solve(void)
{
   if (--depth > 0) return;
   pthread_mutex_lock(&mutex);
   if (--solves == 0 && HAS_OPENBLAS && blas_threads_before != 1) openblas_set_num_threads(blas_threads_before);
   pthread_mutex_unlock(&mutex);
}

/* Checks that memory suffices for the BLAS buffers and stacks of `threads` threads in each concurrent solve, and allocates the
 * buffers: without one OpenBLAS waits forever, and OpenMP ends the process if it cannot start a thread. Returns the number
 * of threads that this solve may use: `threads`, 1 if memory is short, 0 if it does not suffice for one. */
int kschur_prepare_threads(int threads)
{
   void *held[most_prepared];
   int all, ready;

   pthread_mutex_lock(&mutex);
   all = threads*(solves > 1 ? solves : 1);
   if (all > most_prepared) all = most_prepared;
   ready = all < prepared ? all : prepared;
   if (ready < all) {
      for (ready = 0; ready < all; ready++) {
         double more = (HAS_BUFFERS ? buffer_bytes : 0) + (ready > 0 ? thread_bytes + plenty_bytes : left_bytes);

         if (ready >= prepared && !kschur_can_have(more)) break;
         if (HAS_BUFFERS) held[ready] = blas_memory_alloc(0);
      }
      for (int i = 0; i < ready && HAS_BUFFERS; i++) blas_memory_free(held[i]);
      if (ready > prepared) prepared = ready;
   }
   pthread_mutex_unlock(&mutex);
   return ready == all ? threads : ready > 0;
}

/* Blocks SIGINT and SIGTERM in this thread. */
void kschur_block_signals(void)
{
   sigset_t both;

   sigemptyset(&both);
   sigaddset(&both, SIGINT);
   sigaddset(&both, SIGTERM);
   pthread_sigmask(SIG_BLOCK, &both, NULL);
}

/* Makes malloc create the arena of this thread. */
void kschur_make_heap(void)
{
   void *volatile some = malloc(1);

   free(some);
}

/* Sets the number of threads of the BLAS; more than one only if one solve runs and memory suffices. */
void kschur_set_blas_threads(int threads)
{
   pthread_mutex_lock(&mutex);
   if ((solves == 1 || (solves > 1 && threads == 1)) && HAS_OPENBLAS && openblas_get_num_threads() != threads
       && (threads == 1 || kschur_can_have((threads - 1)*(buffer_bytes + thread_bytes) + plenty_bytes)))
      openblas_set_num_threads(threads);
   pthread_mutex_unlock(&mutex);
}
