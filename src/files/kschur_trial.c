/* Runs a reader in a child process, which a damaged file may crash: see kschur_trial.f90. */
#define _XOPEN_SOURCE 700
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

enum { length = 8192 };

/* Result of the child: error code, 0 for none, and message. */
struct verdict {
   int code;
   char message[length];
};

/* Limits the memory of the child to its present size plus `bytes`, if the system reports its size. */
static void limit_memory(double bytes)
{
   struct rlimit limit;
   double pages = 0, most;
   FILE *status = fopen("/proc/self/statm", "r");

   if (status == NULL) return;
   if (fscanf(status, "%lf", &pages) == 1 && getrlimit(RLIMIT_AS, &limit) == 0) {
      most = pages*(double)sysconf(_SC_PAGESIZE) + bytes;
      if (most < (double)limit.rlim_cur) limit.rlim_cur = (rlim_t)most;
      setrlimit(RLIMIT_AS, &limit);
   }
   fclose(status);
}

/* Prepares the child: it prints nothing, dumps no core, and dies by a signal on a crash or at its limit of processor time. */
static void prepare_child(double seconds, double bytes)
{
   const int signals[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPROF};
   const struct rlimit no_core = {0, 0};
   struct itimerval timer = {{0, 0}, {0, 0}};
   sigset_t none;
   int nowhere = open("/dev/null", O_WRONLY);

   dup2(nowhere, STDOUT_FILENO);
   dup2(nowhere, STDERR_FILENO);
   for (size_t i = 0; i < sizeof signals/sizeof *signals; i++) signal(signals[i], SIG_DFL);
   sigemptyset(&none);
   sigprocmask(SIG_SETMASK, &none, NULL);
   setrlimit(RLIMIT_CORE, &no_core);
   timer.it_value.tv_sec = (time_t)seconds;
   timer.it_value.tv_usec = (suseconds_t)(1e6*(seconds - (double)timer.it_value.tv_sec));
   setitimer(ITIMER_PROF, &timer, NULL);
   limit_memory(bytes);
}

/* Opens a pipe with descriptors above the standard ones: the child redirects those, which may be closed here. Returns 0 on
 * failure. */
static int open_pipe(int ends[2])
{
   int low[2], ready;

   if (pipe(low) != 0) return 0;
   for (int i = 0; i < 2; i++) ends[i] = fcntl(low[i], F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
   ready = ends[0] >= 0 && ends[1] >= 0;
   for (int i = 0; i < 2; i++) {
      close(low[i]);
      if (!ready && ends[i] >= 0) close(ends[i]);
   }
   return ready;
}

/* Reads `size` bytes; false at an earlier end. */
static int receive(int from, void *where, size_t size)
{
   size_t got = 0;

   while (got < size) {
      ssize_t piece = read(from, (char *)where + got, size - got);
      if (piece > 0) got += (size_t)piece;
      else if (piece == 0 || errno != EINTR) return 0;
   }
   return 1;
}

/* Calls `attempt` in a child process with limits of processor time and of additional memory. Returns 0 if it returned: `code`
 * and `message`, null-terminated in at most `length` characters, are then those of `attempt`; 1 if the child died; 2 if no
 * child could be created. */
int kschur_try(void (*attempt)(void *context, int *code, char *message), void *context, double seconds, double bytes,
               int *code, char *message)
{
   struct verdict verdict = {0, ""};
   int ends[2], whole;
   pid_t child;

   if (!open_pipe(ends)) return 2;
   child = fork();
   if (child == 0) {
      prepare_child(seconds, bytes);
      attempt(context, &verdict.code, verdict.message);
      _exit(write(ends[1], &verdict, sizeof verdict) != sizeof verdict);
   }
   close(ends[1]);
   whole = child > 0 && receive(ends[0], &verdict, sizeof verdict);
   close(ends[0]);
   if (child < 0) return 2;
   while (waitpid(child, NULL, 0) < 0 && errno == EINTR) continue;
   if (!whole) return 1;
   *code = verdict.code;
   for (size_t i = 0; i < length; i++) message[i] = verdict.message[i];
   message[length - 1] = 0;
   return 0;
}
