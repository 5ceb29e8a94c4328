/* Number of concurrent solves of a process, and threads of its BLAS meanwhile: Fortran 2008 has no atomic counter, and only
 * OpenBLAS lets that number be set. */
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
/* The most that OpenBLAS maps for a thread that is within it, what a thread takes for its stack and its heap, and what
 * is to be left after the first of them, and after each other. */
static const double buffer_bytes = 135e6, thread_bytes = 80e6, left_bytes = 32e6, plenty_bytes = 512e6;
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

void kschur_leave_solve(void)
{
   if (--depth > 0) return;
   pthread_mutex_lock(&mutex);
   if (--solves == 0 && HAS_OPENBLAS && blas_threads_before != 1) openblas_set_num_threads(blas_threads_before);
   pthread_mutex_unlock(&mutex);
}

/* OpenBLAS waits for ever where it gets no buffer, and OpenMP ends the process where it gets no thread: both are asked for
 * before they are used, with as many threads for each of the solves that run. Returns how many threads this solve may have:
 * so many, one where there is no memory for more, 0 where there is none for one. */
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

/* Creates the heap of this thread. */
void kschur_make_heap(void)
{
   void *volatile some = malloc(1);

   free(some);
}

/* Threads of the BLAS: more than one only where nobody else is using it, and where there is memory for them. */
void kschur_set_blas_threads(int threads)
{
   pthread_mutex_lock(&mutex);
   if ((solves == 1 || (solves > 1 && threads == 1)) && HAS_OPENBLAS && openblas_get_num_threads() != threads
       && (threads == 1 || kschur_can_have((threads - 1)*(buffer_bytes + thread_bytes) + plenty_bytes)))
      openblas_set_num_threads(threads);
   pthread_mutex_unlock(&mutex);
}
