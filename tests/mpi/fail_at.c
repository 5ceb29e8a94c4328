/* Lets one process fail at a moment: it is killed when it calls a library, or its memory ends when that returns, or it
 * gets a SIGTERM when METIS has taken those for itself. To be loaded before libraries (LD_PRELOAD), with FAIL_RANK, FAIL_AT (a
 * function, of MUMPS with its job: "dmumps 2"), FAIL_COUNT (the number of the call) and, for memory, FAIL_ROOM (the megabytes
 * that are left). PURPOSES of test_processes.py says what a call is for. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static pid_t self;
static int calls;

__attribute__((constructor)) static void remember(void)
{
   self = getpid();
}

static int is_due(const char *name)
{
   const char *rank = getenv("OMPI_COMM_WORLD_RANK"), *at = getenv("FAIL_AT");

   /* Not in a child that tries to read a file. */
   if (rank == NULL || at == NULL || getpid() != self) return 0;
   if (strcmp(rank, getenv("FAIL_RANK")) != 0 || strcmp(name, at) != 0) return 0;
   return ++calls == atoi(getenv("FAIL_COUNT"));
}

static void end_memory(void)
{
   struct rlimit limit;
   unsigned long pages = 0;
   FILE *file = fopen("/proc/self/statm", "r");

   if (file == NULL || fscanf(file, "%lu", &pages) != 1) abort();
   fclose(file);
   getrlimit(RLIMIT_AS, &limit);
   limit.rlim_cur = pages*(unsigned long)getpagesize() + (rlim_t)atoi(getenv("FAIL_ROOM"))*1000000;
   setrlimit(RLIMIT_AS, &limit);
}

static void before(int due)
{
   if (due && getenv("FAIL_ROOM") == NULL) raise(SIGKILL);
}

static void after(int due)
{
   if (due && getenv("FAIL_ROOM") != NULL) end_memory();
}

/* A structure of MUMPS begins with its communicator, symmetry, host and job. */
void dmumps_(int *id)
{
   void (*next)(int *) = (void (*)(int *))dlsym(RTLD_NEXT, "dmumps_");
   char name[40];
   int due;

   snprintf(name, sizeof name, "dmumps %d", id[3]);
   due = is_due(name);
   before(due);
   next(id);
   after(due);
}

/* The dense products of LDL^T. */
void dgemm_(void *a, void *b, void *m, void *n, void *k, void *alpha, void *x, void *ldx, void *y, void *ldy, void *beta, void *z,
            void *ldz, size_t first, size_t second)
{
   typedef void product(void *, void *, void *, void *, void *, void *, void *, void *, void *, void *, void *, void *, void *,
                        size_t, size_t);
   static product *next;
   int due = is_due("dgemm");

   if (next == NULL) next = (product *)dlsym(RTLD_NEXT, "dgemm_");
   before(due);
   next(a, b, m, n, k, alpha, x, ldx, y, ldy, beta, z, ldz, first, second);
   after(due);
}

void mpi_reduce_f08_(void *sent, void *received, void *count, void *type, void *operation, void *root, void *communicator,
                     void *error)
{
   void (*next)(void *, void *, void *, void *, void *, void *, void *, void *) =
      (void (*)(void *, void *, void *, void *, void *, void *, void *, void *))dlsym(RTLD_NEXT, "mpi_reduce_f08_");
   int due = is_due("MPI_Reduce");

   before(due);
   next(sent, received, count, type, operation, root, communicator, error);
   after(due);
}

void mpi_allgatherv_f08_(void *sent, void *count, void *type, void *received, void *counts, void *places, void *other,
                         void *communicator, void *error)
{
   void (*next)(void *, void *, void *, void *, void *, void *, void *, void *, void *) =
      (void (*)(void *, void *, void *, void *, void *, void *, void *, void *, void *))dlsym(RTLD_NEXT, "mpi_allgatherv_f08_");
   int due = is_due("MPI_Allgatherv");

   before(due);
   next(sent, count, type, received, counts, places, other, communicator, error);
   after(due);
}

int METIS_NodeND(void *n, void *start, void *neighbour, void *weight, void *options, void *order, void *position)
{
   int (*next)(void *, void *, void *, void *, void *, void *, void *) =
      (int (*)(void *, void *, void *, void *, void *, void *, void *))dlsym(RTLD_NEXT, "METIS_NodeND");

   before(is_due("METIS_NodeND"));
   return next(n, start, neighbour, weight, options, order, position);
}

/* Where METIS sets its handler, which knows the way back in its own thread only. */
int gk_sigtrap(void)
{
   int (*next)(void) = (int (*)(void))dlsym(RTLD_NEXT, "gk_sigtrap"), status = next();

   if (is_due("gk_sigtrap")) kill(getpid(), SIGTERM);
   return status;
}

int H5Dread(long set, long type, long memory, long file, long properties, void *buffer)
{
   int (*next)(long, long, long, long, long, void *) = (int (*)(long, long, long, long, long, void *))dlsym(RTLD_NEXT, "H5Dread");

   int due = is_due("H5Dread"), status;

   before(due);
   status = next(set, type, memory, file, properties, buffer);
   after(due);
   return status;
}

int H5Dwrite(long set, long type, long memory, long file, long properties, const void *buffer)
{
   int (*next)(long, long, long, long, long, const void *) =
      (int (*)(long, long, long, long, long, const void *))dlsym(RTLD_NEXT, "H5Dwrite");

   before(is_due("H5Dwrite"));
   return next(set, type, memory, file, properties, buffer);
}
