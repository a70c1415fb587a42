// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program (LD_PRELOAD), it makes a folder behave as one that hosts share over a network. The
// environment says how:
//   SHIM_FOLDER      the folder; what is neither it nor below it is left alone
//   SHIM_HIDDEN_MS   a file that another process made is not found for so long, unless its folder was listed since
//   SHIM_STALE_EVERY of the openings and readings, each of so many fails with ESTALE
//   SHIM_CLOCK_S     the clock of this host is wrong by so many seconds
// Locks are refused with ENOLCK.
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define NEXT(name)                                       \
  ({                                                     \
    static __typeof__(&name) next;                       \
    if (!next) *(void**)&next = dlsym(RTLD_NEXT, #name); \
    next;                                                \
  })

enum { kMost = 4096 };

static struct {
  const char* folder;
  size_t length;
  long hidden_ms, stale_every, clock_s;
} settings;

static atomic_ulong calls;
static _Atomic ino_t own[kMost];  // files that this process made
static atomic_uint own_count;
static struct {
  _Atomic ino_t folder;
  atomic_llong at_ms;
} listed[kMost];

static long number(const char* name) {
  const char* text = getenv(name);
  return text ? atol(text) : 0;
}

__attribute__((constructor)) static void read_settings(void) {
  settings.folder = getenv("SHIM_FOLDER");
  settings.length = settings.folder ? strlen(settings.folder) : 0;
  settings.hidden_ms = number("SHIM_HIDDEN_MS");
  settings.stale_every = number("SHIM_STALE_EVERY");
  settings.clock_s = number("SHIM_CLOCK_S");
}

static int is_below(const char* path) {
  return settings.length && strncmp(path, settings.folder, settings.length) == 0 &&
         (path[settings.length] == '/' || !path[settings.length]);
}

static int is_descriptor_below(int descriptor) {
  char link[40], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const long length = syscall(SYS_readlinkat, AT_FDCWD, link, path, sizeof path - 1);
  path[length > 0 ? length : 0] = 0;
  return is_below(path);
}

static long long ms_of(const struct timespec* time) { return time->tv_sec * 1000LL + time->tv_nsec / 1000000; }

static long long now_ms(void) {  // by the right clock
  struct timespec now;
  syscall(SYS_clock_gettime, CLOCK_REALTIME, &now);
  return ms_of(&now);
}

static int is_stale(void) { return settings.stale_every && (calls++ + 1) % (unsigned long)settings.stale_every == 0; }

static void note_listing(ino_t folder) {
  for (unsigned i = 0; i < kMost; ++i) {
    ino_t empty = 0;
    if (listed[i].folder != folder && !atomic_compare_exchange_strong(&listed[i].folder, &empty, folder)) continue;
    listed[i].at_ms = now_ms();
    return;
  }
}

static long long listed_at_ms(const char* file) {
  char folder[4096];
  struct stat status;
  snprintf(folder, sizeof folder, "%s", file);
  *strrchr(folder, '/') = 0;
  if (stat(folder, &status) != 0) return 0;
  for (unsigned i = 0; i < kMost && listed[i].folder; ++i)
    if (listed[i].folder == status.st_ino) return listed[i].at_ms;
  return 0;
}

static int is_hidden(const char* path, const struct stat* status) {
  const long long made = ms_of(&status->st_ctim);
  for (unsigned i = 0; i < kMost && own[i]; ++i)
    if (own[i] == status->st_ino) return 0;
  // The times of files are those of the kernel's last tick.
  return now_ms() - made < settings.hidden_ms && listed_at_ms(path) + 10 < made;
}

/// What an opening below the folder comes to: the descriptor, or -1 with errno.
static int opened(const char* path, int flags, int descriptor) {
  struct stat status;
  if (descriptor < 0 || fstat(descriptor, &status) != 0) return descriptor;
  if (flags & O_CREAT) {
    own[own_count++ % kMost] = status.st_ino;
  } else if (S_ISDIR(status.st_mode)) {
    note_listing(status.st_ino);
  } else if (is_hidden(path, &status)) {
    close(descriptor);
    errno = ENOENT;
    return -1;
  }
  return descriptor;
}

#define OPEN(name, parameters, arguments)                                           \
  int name parameters {                                                             \
    va_list more;                                                                   \
    va_start(more, flags);                                                          \
    const mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(more, mode_t) : 0; \
    va_end(more);                                                                   \
    if (!is_below(path)) return NEXT(name) arguments;                               \
    if (!(flags & O_DIRECTORY) && is_stale()) {                                     \
      errno = ESTALE;                                                               \
      return -1;                                                                    \
    }                                                                               \
    return opened(path, flags, NEXT(name) arguments);                               \
  }
OPEN(open, (const char* path, int flags, ...), (path, flags, mode))
OPEN(open64, (const char* path, int flags, ...), (path, flags, mode))
OPEN(openat, (int at, const char* path, int flags, ...), (at, path, flags, mode))
OPEN(openat64, (int at, const char* path, int flags, ...), (at, path, flags, mode))

DIR* opendir(const char* path) {
  DIR* folder = NEXT(opendir)(path);
  struct stat status;
  if (folder && is_below(path) && fstat(dirfd(folder), &status) == 0) note_listing(status.st_ino);
  return folder;
}

#define READ(name, parameters, arguments)                                        \
  ssize_t name parameters {                                                      \
    if (settings.stale_every && is_descriptor_below(descriptor) && is_stale()) { \
      errno = ESTALE;                                                            \
      return -1;                                                                 \
    }                                                                            \
    return NEXT(name) arguments;                                                 \
  }
READ(read, (int descriptor, void* to, size_t size), (descriptor, to, size))
READ(pread, (int descriptor, void* to, size_t size, off_t from), (descriptor, to, size, from))
READ(pread64, (int descriptor, void* to, size_t size, off64_t from), (descriptor, to, size, from))

int flock(int descriptor, int what) {
  if (!is_descriptor_below(descriptor)) return NEXT(flock)(descriptor, what);
  errno = ENOLCK;
  return -1;
}

#define LOCK(name)                                                                                        \
  int name(int descriptor, int what, ...) {                                                               \
    va_list more;                                                                                         \
    va_start(more, what);                                                                                 \
    void* argument = va_arg(more, void*);                                                                 \
    va_end(more);                                                                                         \
    const int locks = what == F_SETLK || what == F_SETLKW || what == F_OFD_SETLK || what == F_OFD_SETLKW; \
    if (locks && is_descriptor_below(descriptor)) {                                                       \
      errno = ENOLCK;                                                                                     \
      return -1;                                                                                          \
    }                                                                                                     \
    return NEXT(name)(descriptor, what, argument);                                                        \
  }
LOCK(fcntl)
LOCK(fcntl64)

int clock_gettime(clockid_t clock, struct timespec* time) {
  const int result = NEXT(clock_gettime)(clock, time);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) time->tv_sec += settings.clock_s;
  return result;
}

time_t time(time_t* to) {
  const time_t now = NEXT(time)(NULL) + settings.clock_s;
  if (to) *to = now;
  return now;
}

int gettimeofday(struct timeval* restrict to, void* restrict zone) {
  const int result = NEXT(gettimeofday)(to, zone);
  if (result == 0) to->tv_sec += settings.clock_s;
  return result;
}
