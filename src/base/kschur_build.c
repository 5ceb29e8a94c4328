/* Versions of the libraries that this one was built with, from their headers if these are installed; OpenBLAS is asked when
 * it runs, as another BLAS may have been loaded instead. */
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#ifdef __has_include
#if __has_include(<dmumps_c.h>)
#include <dmumps_c.h>
#endif
#if __has_include(<metis.h>)
#include <metis.h>
#endif
#if __has_include(<suitesparse/amd.h>)
#include <suitesparse/amd.h>
#elif __has_include(<amd.h>)
#include <amd.h>
#endif
#ifndef KSCHUR_WITHOUT_HDF5
#if __has_include(<H5public.h>)
#include <H5public.h>
#elif __has_include(<hdf5/serial/H5public.h>)
#include <hdf5/serial/H5public.h>
#endif
#endif
#endif

#ifdef __GNUC__
extern char *openblas_get_config(void) __attribute__((weak));
#define HAS_OPENBLAS (openblas_get_config != NULL)
#else
static char *openblas_get_config(void) { return ""; }
#define HAS_OPENBLAS 0
#endif

#define TEXT_OF(number) #number
#define TEXT(number) TEXT_OF(number)

#ifdef MUMPS_VERSION
#define MUMPS_TEXT "MUMPS " MUMPS_VERSION
#else
#define MUMPS_TEXT "MUMPS"
#endif
#ifdef METIS_VER_MAJOR
#define METIS_TEXT ", METIS " TEXT(METIS_VER_MAJOR) "." TEXT(METIS_VER_MINOR) "." TEXT(METIS_VER_SUBMINOR)
#else
#define METIS_TEXT ", METIS"
#endif
#ifdef AMD_MAIN_VERSION
#define AMD_TEXT ", AMD " TEXT(AMD_MAIN_VERSION) "." TEXT(AMD_SUB_VERSION) "." TEXT(AMD_SUBSUB_VERSION)
#else
#define AMD_TEXT ", AMD"
#endif
#ifdef KSCHUR_WITHOUT_HDF5
#define HDF5_TEXT ", no HDF5"
#elif defined(H5_VERS_MAJOR)
#define HDF5_TEXT ", HDF5 " TEXT(H5_VERS_MAJOR) "." TEXT(H5_VERS_MINOR) "." TEXT(H5_VERS_RELEASE)
#else
#define HDF5_TEXT ", HDF5"
#endif
#ifdef KSCHUR_WITHOUT_ARPACK
#define ARPACK_TEXT ", no ARPACK"
#else
#define ARPACK_TEXT ", ARPACK"
#endif
#ifdef KSCHUR_WITH_MPI
#define MPI_TEXT ", MPI"
#else
#define MPI_TEXT ""
#endif

/* Writes names and versions to `text`, of `length` bytes including the null. */
void kschur_libraries(char *text, int length)
{
   const char *config = HAS_OPENBLAS ? openblas_get_config() : "BLAS and LAPACK";
   /* "OpenBLAS 0.3.21 DYNAMIC_ARCH ...": the first two words. */
   size_t words = strlen(config), name = strcspn(config, " ");

   if (HAS_OPENBLAS && config[name]) words = name + 1 + strcspn(config + name + 1, " ");
   snprintf(text, (size_t)length, "%s%s%s, %.*s%s%s%s", MUMPS_TEXT, METIS_TEXT, AMD_TEXT, (int)words, config, HDF5_TEXT,
            ARPACK_TEXT, MPI_TEXT);
}
