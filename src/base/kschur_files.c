/* File-system services of kschur_files.f90. */
#define _DEFAULT_SOURCE
#define _XOPEN_SOURCE 700
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

/* Largest length of a path with its suffix; of a truncated name before the suffix. */
enum { longest_path = 4096, longest_name = 200 };

static const char mark[] = ".partial-XXXXXX";
static const int folder_flags = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;

/* 0: missing, 1: file, 2: folder, 3: pipe, device or socket. Follows links. */
int kschur_kind_of_file(const char *path)
{
   struct stat status;

   if (stat(path, &status) != 0) return 0;
   return S_ISREG(status.st_mode) ? 1 : S_ISDIR(status.st_mode) ? 2 : 3;
}

/* Removes the contents of an open folder; does not follow links. */
static void empty_folder(int folder)
{
   DIR *entries = fdopendir(dup(folder));
   struct dirent *entry;

   if (entries == NULL) return;
   rewinddir(entries);
   while ((entry = readdir(entries)) != NULL) {
      int inner;
      if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0) continue;
      if (unlinkat(folder, entry->d_name, 0) == 0) continue;
      inner = openat(folder, entry->d_name, folder_flags);
      if (inner < 0) continue;
      empty_folder(inner);
      close(inner);
      unlinkat(folder, entry->d_name, AT_REMOVEDIR);
   }
   closedir(entries);
}

/* Splits a path: returns its name, and writes its folder, followed by ".", to `parent`. */
static const char *split(const char *path, char *parent)
{
   const char *slash = strrchr(path, '/');
   size_t length = slash == NULL ? 0 : (size_t)(slash - path) + 1;

   memcpy(parent, path, length);
   memcpy(parent + length, ".", 2);
   return path + length;
}

/* Removes staging folders left by killed runs: those beginning with `stem` that no process has locked. */
static void remove_strays(const char *parent, const char *stem)
{
   DIR *entries = opendir(parent);
   struct dirent *entry;

   if (entries == NULL) return;
   while ((entry = readdir(entries)) != NULL) {
      int stray;
      if (strncmp(entry->d_name, stem, strlen(stem)) != 0 || strlen(entry->d_name) != strlen(stem) + 6) continue;
      stray = openat(dirfd(entries), entry->d_name, folder_flags);
      if (stray < 0) continue;
      if (flock(stray, LOCK_EX | LOCK_NB) == 0) {
         empty_folder(stray);
         unlinkat(dirfd(entries), entry->d_name, AT_REMOVEDIR);
      }
      close(stray);
   }
   closedir(entries);
}

/* Opens and locks a new staging folder. Returns 1, 0 if another process took it for one left behind and removes it, or -1 on
 * failure. On a file system without locks it succeeds unlocked. */
static int lock_folder(const char *path, int *folder)
{
   struct stat opened, named;

   *folder = open(path, folder_flags);
   if (*folder < 0) return errno == ENOENT ? 0 : -1;
   if (flock(*folder, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      close(*folder);
      return 0;
   }
   if (fstat(*folder, &opened) == 0 && stat(path, &named) == 0 && opened.st_ino == named.st_ino) return 1;
   close(*folder);
   return 0;
}

/* Creates and locks a staging folder with a unique name beside `path`, after removing those of killed runs. Writes its
 * null-terminated path to `staging`. Returns its descriptor, or -1 with errno. */
int kschur_stage(const char *path, char *staging)
{
   char parent[longest_path], stem[longest_name + sizeof mark];
   const char *name;
   int folder, tries;

   errno = ENAMETOOLONG;
   if (strlen(path) + sizeof mark > longest_path) return -1;
   name = split(path, parent);
   snprintf(stem, sizeof stem, "%.*s%.9s", longest_name, name, mark);
   remove_strays(parent, stem);
   for (tries = 0; tries < 100; tries++) {
      int locked;
      snprintf(staging, longest_path, "%.*s%sXXXXXX", (int)(name - path), path, stem);
      if (mkdtemp(staging) == NULL) return -1;
      locked = lock_folder(staging, &folder);
      if (locked > 0) return folder;
      if (locked < 0) break;
   }
   return -1;
}

/* Creates a file and allocates disk space for `bytes` bytes, if the file system can. Returns 0 or errno. */
int kschur_reserve(const char *path, long long bytes)
{
   int file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666), failure;

   if (file < 0) return errno;
   failure = posix_fallocate(file, 0, (off_t)bytes);
   close(file);
   return failure == EOPNOTSUPP || failure == EINVAL ? 0 : failure;
}

/* Returns 0 if the file system of a folder has less than `bytes` bytes of free space; 1 also if that is unknown. */
int kschur_has_room(const char *path, long long bytes)
{
   struct statvfs status;

   if (statvfs(path, &status) != 0) return 1;
   return (double)bytes <= (double)status.f_bavail*(double)status.f_frsize;
}

/* Removes a folder of kschur_stage with its contents. */
void kschur_unstage(int folder, const char *staging)
{
   if (folder < 0) return;
   empty_folder(folder);
   rmdir(staging);
   close(folder);
}

/* Flushes a file, or a folder with its files, to disk. Returns 0 or errno. */
static int bring_to_disk(int parent, const char *name)
{
   int file = openat(parent, name, O_RDONLY | O_CLOEXEC), copy, failure = 0;
   DIR *entries;
   struct dirent *entry;

   if (file < 0) return errno;
   copy = dup(file);
   entries = copy < 0 ? NULL : fdopendir(copy);
   if (entries == NULL && copy >= 0) close(copy);
   while (entries != NULL && failure == 0 && (entry = readdir(entries)) != NULL)
      if (entry->d_name[0] != '.') failure = bring_to_disk(file, entry->d_name);
   if (entries != NULL) closedir(entries);
   if (failure == 0 && fsync(file) != 0 && errno != EINVAL && errno != EROFS) failure = errno;
   close(file);
   return failure;
}

/* Moves the files of one folder into another. Returns 0 or errno. */
static int move_files(const char *from, const char *to)
{
   DIR *entries = opendir(from);
   int target = open(to, O_RDONLY | O_DIRECTORY | O_CLOEXEC), failure = 0;
   struct dirent *entry;

   if (entries == NULL || target < 0) failure = errno;
   while (failure == 0 && (entry = readdir(entries)) != NULL)
      if (entry->d_name[0] != '.' && renameat(dirfd(entries), entry->d_name, target, entry->d_name) != 0) failure = errno;
   if (entries != NULL) closedir(entries);
   if (failure == 0 && fsync(target) != 0 && errno != EINVAL && errno != EROFS) failure = errno;
   if (target >= 0) close(target);
   return failure;
}

/* Flushes a finished file or folder to disk and renames it to `path`, which atomically replaces a file or an empty folder; if
 * `path` is a folder with files, moves the new files into it one by one. Returns 0 or errno. */
int kschur_publish(const char *finished, const char *path)
{
   char parent[longest_path];
   int failure = bring_to_disk(AT_FDCWD, finished);
   DIR *folder;

   if (failure != 0) return failure;
   if (rename(finished, path) != 0) {
      failure = errno;
      return kschur_kind_of_file(finished) == 2 && kschur_kind_of_file(path) == 2 ? move_files(finished, path) : failure;
   }
   split(path, parent);
   folder = opendir(parent);
   if (folder == NULL) return 0;
   fsync(dirfd(folder));
   closedir(folder);
   return 0;
}

/* The system's message for errno, null-terminated, in at most `size` characters. */
void kschur_system_reason(int failure, char *words, size_t size)
{
   snprintf(words, size, "%s", strerror(failure));
}

int kschur_errno(void)
{
   return errno;
}
