/* A file of 8-byte words, written and read sequentially; the last word is a checksum of all others and of their size. */
#define _XOPEN_SOURCE 700
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { damaged = -1 };

/* Initial value of a checksum, nonzero so that zero words count. */
static const uint64_t beginning = UINT64_C(14695981039346656037);

struct archive {
   FILE *file;
   uint64_t sum, bytes;
   int saving;
};

/* Updates a checksum by words; both steps are invertible, so that every word changes it. */
uint64_t kschur_checksum(uint64_t sum, const void *words, size_t bytes)
{
   const unsigned char *next = words;
   uint64_t word;
   size_t i;

   for (i = 0; i + sizeof word <= bytes; i += sizeof word) {
      memcpy(&word, next + i, sizeof word);
      sum = (sum ^ word)*UINT64_C(1099511628211);
      sum ^= sum >> 32;
   }
   if (i == bytes) return sum;
   word = 0;
   memcpy(&word, next + i, bytes - i);
   return kschur_checksum(sum, &word, sizeof word);
}

/* The last word of a file. It includes the number of bytes: otherwise zeros after the end would not be detected. */
static uint64_t closing_sum(uint64_t sum, uint64_t bytes)
{
   return kschur_checksum(sum, &bytes, sizeof bytes);
}

/* Verifies the checksum of a file: 0, `damaged`, or errno. */
static int verify(FILE *file)
{
   uint64_t buffer[8192], sum = beginning, last = 0, bytes = 0;
   size_t count;
   int words = 0;

   while ((count = fread(buffer, 1, sizeof buffer, file)) > 0) {
      if (count%sizeof last != 0) return damaged;
      if (words) sum = kschur_checksum(sum, &last, sizeof last);
      words = 1;
      sum = kschur_checksum(sum, buffer, count - sizeof last);
      last = buffer[count/sizeof last - 1];
      bytes += count;
   }
   if (ferror(file)) return errno;
   return words && closing_sum(sum, bytes - sizeof last) == last ? 0 : damaged;
}

/* Opens an archive; NULL on failure, with errno or `damaged` in `failure`. */
void *kschur_archive_open(const char *path, int saving, int *failure)
{
   struct archive *a = malloc(sizeof *a);

   *failure = ENOMEM;
   if (a == NULL) return NULL;
   a->sum = beginning;
   a->bytes = 0;
   a->saving = saving;
   a->file = fopen(path, saving ? "wb" : "rb");
   *failure = a->file == NULL ? errno : 0;
   if (a->file != NULL && !saving) {
      *failure = verify(a->file);
      rewind(a->file);
   }
   if (*failure == 0) return a;
   if (a->file != NULL) fclose(a->file);
   free(a);
   return NULL;
}

/* Writes or reads words; returns 0, errno or `damaged`. */
int kschur_archive_carry(void *address, void *words, size_t bytes)
{
   struct archive *a = address;

   errno = 0;
   if (a->saving) {
      a->sum = kschur_checksum(a->sum, words, bytes);
      a->bytes += bytes;
      if (fwrite(words, 1, bytes, a->file) != bytes) return errno ? errno : EIO;
   } else if (fread(words, 1, bytes, a->file) != bytes) {
      return errno ? errno : damaged;
   }
   return 0;
}

int kschur_archive_close(void *address)
{
   struct archive *a = address;
   uint64_t sum = closing_sum(a->sum, a->bytes);
   int failure = 0;

   errno = 0;
   if (a->saving && fwrite(&sum, 1, sizeof sum, a->file) != sizeof sum) failure = errno ? errno : EIO;
   if (fclose(a->file) != 0 && failure == 0) failure = errno;
   free(a);
   return failure;
}
