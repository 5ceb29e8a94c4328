/* Reads and validates the global heaps of an HDF5 file, which hold variable-length strings: see kschur_hdf5_strings.f90. */
#define _XOPEN_SOURCE 700
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

/* Header sizes of a heap and of an object. */
enum { header = 16 };

/* An unsigned little-endian integer of `count` bytes. */
static uint64_t number(const unsigned char *bytes, int count)
{
   uint64_t value = 0;

   while (count-- > 0) value = value << 8 | bytes[count];
   return value;
}

/* Reads `count` bytes at an address of the file; false if there are fewer. */
static int read_at(int file, uint64_t address, void *bytes, size_t count)
{
   return address < INT64_MAX - count && pread(file, bytes, count, (off_t)address) == (ssize_t)count;
}

/* Copies an object of a global heap to `bytes`. `reference` is as stored in the file, little-endian: length of the object (4
 * bytes), address of the heap relative to `base` (8), number of the object (4). Returns 0, or -1 if the object does not exist,
 * or the sizes of the objects do not add up to that of the heap. */
int kschur_heap_object(int file, uint64_t base, const unsigned char *reference, char *bytes)
{
   const size_t length = number(reference, 4);
   const uint64_t wanted = number(reference + 12, 4);
   uint64_t heap = number(reference + 4, 8), size, at, found;
   unsigned char head[header];
   int outcome = -1;

   if (length == 0) return 0;
   if (heap > INT64_MAX - base) return -1;
   heap += base;
   if (!read_at(file, heap, head, header) || memcmp(head, "GCOL\1\0\0\0", 8) != 0) return -1;
   size = number(head + 8, 8);
   for (at = header; size >= header && at <= size - header; at += header + (found + 7)/8*8) {
      if (!read_at(file, heap + at, head, header)) return -1;
      found = number(head + 8, 8);
      /* Object 0 is the free space at the end, with its header. */
      if (number(head, 2) == 0) return found == size - at ? outcome : -1;
      if (found > size - header - at) return -1;
      if (number(head, 2) != wanted) continue;
      if (found < length || !read_at(file, heap + at + header, bytes, length)) return -1;
      outcome = 0;
   }
   return outcome;
}

/* A conversion function for HDF5 that leaves the values as they are. */
int kschur_as_they_are(int64_t source, int64_t target, void *data, size_t count, size_t stride, size_t background_stride,
                       void *values, void *background, int64_t transfer)
{
   (void)source, (void)target, (void)data, (void)count, (void)stride, (void)background_stride, (void)values;
   (void)background, (void)transfer;
   return 0;
}
