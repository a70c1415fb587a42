// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program (LD_PRELOAD), it makes a call of a system function fail, as a full disk or a lack of memory
// would. It counts from main() on, each process by itself. The environment says what fails:
//   FAULT_CALL   a name of kNames below        FAULT_N      its n-th call, from 1
//   FAULT_TIMES  1 (default) or forever: that call and all after it
//   FAULT_ERRNO  a number, else what suits the call
//   FAULT_IN     main (default): the first program only; children: only what it starts; all
//   FAULT_BELOW  a folder: what is not below it neither counts nor fails; descriptors count by the file that they are
//   of FAULT_MARK   a file that is made when a call fails: with FAULT_TIMES=1, all processes together fail once
//   FAULT_COUNT_FILE  a file of two rows of numbers: the most calls of each kind in the first program, and in a child
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum Call {
  kOpen,
  kRead,
  kWrite,
  kClose,
  kRename,
  kMkdir,
  kRemove,
  kTruncate,
  kFsync,
  kLock,
  kMmap,
  kMalloc,
  kLoaderMalloc,
  kThread,
  kFork,
  kExec,
  kPipe,
  kDup,
  kPoll,
  kCalls
};
static const char* const kNames[kCalls] = {"open",     "read",  "write", "close", "rename", "mkdir",         "remove",
                                           "truncate", "fsync", "lock",  "mmap",  "malloc", "loader_malloc", "thread",
                                           "fork",     "exec",  "pipe",  "dup",   "poll"};
static const int kErrors[kCalls] = {EMFILE, EIO,    ENOSPC, EIO,    ENOSPC, ENOSPC, EACCES, ENOSPC, EIO,  ENOLCK,
                                    ENOMEM, ENOMEM, ENOMEM, EAGAIN, EAGAIN, ENOMEM, EMFILE, EMFILE, EINTR};

static struct {
  int call, error, is_forever, in_main, in_children, is_main_program;
  long n;
  const char *below, *mark;
  size_t below_length;
  _Atomic uint64_t* most;  // [2][kCalls], shared by all processes
} settings = {.call = -1};

static _Atomic int is_active;
static _Atomic pid_t main_process, counted_process;
static _Atomic uint64_t counts[kCalls];
static __thread int inside __attribute__((tls_model("initial-exec")));  // our own calls neither count nor fail

// The next definition of a function, after ours.
#define NEXT(name)                              \
  ({                                            \
    static __typeof__(&name) next;              \
    if (!next) {                                \
      ++inside;                                 \
      *(void**)&next = dlsym(RTLD_NEXT, #name); \
      --inside;                                 \
    }                                           \
    next;                                       \
  })

static void open_counts(const char* file) {
  const size_t size = 2 * kCalls * sizeof(uint64_t);
  const int descriptor = (int)syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) return;
  if (syscall(SYS_ftruncate, descriptor, size) == 0) {
    void* table = (void*)syscall(SYS_mmap, NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    if (table != MAP_FAILED) settings.most = table;
  }
  syscall(SYS_close, descriptor);
}

static void read_settings(void) {
  ++inside;
  const char* call = getenv("FAULT_CALL");
  for (int i = 0; call && i < kCalls; ++i)
    if (strcmp(call, kNames[i]) == 0) settings.call = i;
  if (call && settings.call < 0) {
    dprintf(2, "fault_library: there is no call '%s'\n", call);
    _exit(99);
  }
  const char* n = getenv("FAULT_N");
  settings.n = n ? atol(n) : 1;
  const char* times = getenv("FAULT_TIMES");
  settings.is_forever = times && strcmp(times, "forever") == 0;
  const char* error = getenv("FAULT_ERRNO");
  settings.error = error ? atoi(error) : settings.call >= 0 ? kErrors[settings.call] : 0;
  const char* in = getenv("FAULT_IN");
  settings.in_main = !in || strcmp(in, "children") != 0;
  settings.in_children = in && strcmp(in, "main") != 0;
  settings.below = getenv("FAULT_BELOW");
  settings.below_length = settings.below ? strlen(settings.below) : 0;
  settings.mark = getenv("FAULT_MARK");
  settings.is_main_program = !getenv("FAULT_MAIN");
  if (settings.is_main_program) main_process = getpid();
  setenv("FAULT_MAIN", "1", 1);  // what it starts are children
  const char* file = getenv("FAULT_COUNT_FILE");
  if (file) open_counts(file);
  --inside;
}

typedef int Main(int, char**, char**);
static Main* real_main;

static int counted_main(int count, char** arguments, char** environment) {
  is_active = 1;
  return real_main(count, arguments, environment);
}

int __libc_start_main(Main* main, int count, char** arguments, void (*init)(void), void (*fini)(void),
                      void (*loader_fini)(void), void* stack_end) {
  typedef int Start(Main*, int, char**, void (*)(void), void (*)(void), void (*)(void), void*);
  real_main = main;
  read_settings();
  Start* start = (Start*)dlsym(RTLD_NEXT, "__libc_start_main");
  return start(counted_main, count, arguments, init, fini, loader_fini, stack_end);
}

static int is_text_below(const char* path) {
  return strncmp(path, settings.below, settings.below_length) == 0 &&
         (path[settings.below_length] == '/' || !path[settings.below_length]);
}

static int link_of(const char* link, char* text, size_t size) {
  const long length = syscall(SYS_readlinkat, AT_FDCWD, link, text, size - 1);
  text[length > 0 ? length : 0] = 0;
  return length > 0;
}

/// Whether a path, relative to a folder's descriptor where it is relative, or a descriptor itself is below FAULT_BELOW.
static int is_below(int at, const char* path) {
  if (!settings.below) return 1;
  if (path && path[0] == '/') return is_text_below(path);
  char link[40] = "/proc/self/cwd", base[8192];
  if (at != AT_FDCWD) snprintf(link, sizeof link, "/proc/self/fd/%d", at);
  if (!link_of(link, base, 4096)) return 0;
  if (path) {
    strncat(base, "/", 2);
    strncat(base, path, sizeof base - strlen(base) - 1);
  }
  return is_text_below(base);
}

/// That this call is the one to fail; with FAULT_TIMES=1 no process may have failed before.
static int is_its_turn(int call, int is_main, uint64_t number) {
  if (call != settings.call || !(is_main ? settings.in_main : settings.in_children)) return 0;
  if (settings.is_forever ? number < (uint64_t)settings.n : number != (uint64_t)settings.n) return 0;
  if (!settings.mark) return 1;
  const int descriptor = (int)syscall(SYS_openat, AT_FDCWD, settings.mark,
                                      O_WRONLY | O_CREAT | O_CLOEXEC | (settings.is_forever ? 0 : O_EXCL), 0666);
  if (descriptor >= 0) syscall(SYS_close, descriptor);
  return descriptor >= 0 || settings.is_forever;
}

static int fails(int call, int at, const char* path) {
  if (!is_active || inside) return 0;
  ++inside;
  const int before = errno;
  int result = 0;
  if (at == -1 || is_below(at, path)) {
    const pid_t self = getpid();
    if (self != counted_process) {  // forked
      counted_process = self;
      for (int i = 0; i < kCalls; ++i) counts[i] = 0;
    }
    const int is_main = self == main_process;
    const uint64_t number = ++counts[call];
    if (settings.most) {
      _Atomic uint64_t* most = &settings.most[(is_main ? 0 : kCalls) + call];
      uint64_t known = *most;
      while (number > known && !atomic_compare_exchange_weak(most, &known, number)) {
      }
    }
    result = is_its_turn(call, is_main, number);
  }
  --inside;
  errno = result ? settings.error : before;
  return result;
}

// A function that fails before it does anything.
#define FUNCTION(type, name, parameters, arguments, call, at, path, failed) \
  type name parameters {                                                    \
    if (fails(call, at, path)) return failed;                               \
    return NEXT(name) arguments;                                            \
  }
// One that has done its work when it fails.
#define FUNCTION_AFTER(type, name, parameters, arguments, call, at, failed) \
  type name parameters {                                                    \
    const int is_failing = fails(call, at, NULL), error = errno;            \
    const type result = NEXT(name) arguments;                               \
    if (!is_failing) return result;                                         \
    errno = error;                                                          \
    return failed;                                                          \
  }
#define OPEN(name, parameters, arguments, at)                                       \
  int name parameters {                                                             \
    va_list more;                                                                   \
    va_start(more, flags);                                                          \
    const mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(more, mode_t) : 0; \
    va_end(more);                                                                   \
    if (fails(kOpen, at, path)) return -1;                                          \
    return NEXT(name) arguments;                                                    \
  }

#define NO_FOLDER (-2)  // below none that is asked for
OPEN(open, (const char* path, int flags, ...), (path, flags, mode), AT_FDCWD)
OPEN(open64, (const char* path, int flags, ...), (path, flags, mode), AT_FDCWD)
OPEN(openat, (int at, const char* path, int flags, ...), (at, path, flags, mode), at)
OPEN(openat64, (int at, const char* path, int flags, ...), (at, path, flags, mode), at)
FUNCTION(int, creat, (const char* path, mode_t mode), (path, mode), kOpen, AT_FDCWD, path, -1)
FUNCTION(int, creat64, (const char* path, mode_t mode), (path, mode), kOpen, AT_FDCWD, path, -1)
FUNCTION(FILE*, fopen, (const char* path, const char* mode), (path, mode), kOpen, AT_FDCWD, path, NULL)
FUNCTION(FILE*, fopen64, (const char* path, const char* mode), (path, mode), kOpen, AT_FDCWD, path, NULL)
FUNCTION(DIR*, opendir, (const char* path), (path), kOpen, AT_FDCWD, path, NULL)
FUNCTION(DIR*, fdopendir, (int at), (at), kOpen, at, NULL, NULL)
FUNCTION(int, shm_open, (const char* path, int flags, mode_t mode), (path, flags, mode), kOpen, NO_FOLDER, path, -1)
FUNCTION(int, memfd_create, (const char* path, unsigned flags), (path, flags), kOpen, NO_FOLDER, path, -1)

FUNCTION(ssize_t, read, (int at, void* data, size_t size), (at, data, size), kRead, at, NULL, -1)
FUNCTION(ssize_t, readv, (int at, const struct iovec* parts, int count), (at, parts, count), kRead, at, NULL, -1)
FUNCTION(ssize_t, pread, (int at, void* data, size_t size, off_t from), (at, data, size, from), kRead, at, NULL, -1)
FUNCTION(ssize_t, pread64, (int at, void* data, size_t size, off64_t from), (at, data, size, from), kRead, at, NULL, -1)
FUNCTION(ssize_t, recv, (int at, void* data, size_t size, int flags), (at, data, size, flags), kRead, at, NULL, -1)
FUNCTION(ssize_t, recvmsg, (int at, struct msghdr* message, int flags), (at, message, flags), kRead, at, NULL, -1)

FUNCTION(ssize_t, write, (int at, const void* data, size_t size), (at, data, size), kWrite, at, NULL, -1)
FUNCTION(ssize_t, writev, (int at, const struct iovec* parts, int count), (at, parts, count), kWrite, at, NULL, -1)
FUNCTION(ssize_t, pwrite, (int at, const void* data, size_t size, off_t to), (at, data, size, to), kWrite, at, NULL, -1)
FUNCTION(ssize_t, pwrite64, (int at, const void* data, size_t size, off64_t to), (at, data, size, to), kWrite, at, NULL,
         -1)
FUNCTION(ssize_t, send, (int at, const void* data, size_t size, int flags), (at, data, size, flags), kWrite, at, NULL,
         -1)
FUNCTION(ssize_t, sendmsg, (int at, const struct msghdr* message, int flags), (at, message, flags), kWrite, at, NULL,
         -1)

FUNCTION_AFTER(int, close, (int at), (at), kClose, at, -1)
FUNCTION_AFTER(int, fclose, (FILE * stream), (stream), kClose, fileno(stream), EOF)

FUNCTION(int, rename, (const char* from, const char* to), (from, to), kRename, AT_FDCWD, to, -1)
FUNCTION(int, renameat, (int from_at, const char* from, int to_at, const char* to), (from_at, from, to_at, to), kRename,
         to_at, to, -1)
FUNCTION(int, renameat2, (int from_at, const char* from, int to_at, const char* to, unsigned flags),
         (from_at, from, to_at, to, flags), kRename, to_at, to, -1)
FUNCTION(int, link, (const char* from, const char* to), (from, to), kRename, AT_FDCWD, to, -1)
FUNCTION(int, linkat, (int from_at, const char* from, int to_at, const char* to, int flags),
         (from_at, from, to_at, to, flags), kRename, to_at, to, -1)
FUNCTION(int, mkdir, (const char* path, mode_t mode), (path, mode), kMkdir, AT_FDCWD, path, -1)
FUNCTION(int, mkdirat, (int at, const char* path, mode_t mode), (at, path, mode), kMkdir, at, path, -1)
FUNCTION(int, unlink, (const char* path), (path), kRemove, AT_FDCWD, path, -1)
FUNCTION(int, unlinkat, (int at, const char* path, int flags), (at, path, flags), kRemove, at, path, -1)
FUNCTION(int, rmdir, (const char* path), (path), kRemove, AT_FDCWD, path, -1)
FUNCTION(int, remove, (const char* path), (path), kRemove, AT_FDCWD, path, -1)
FUNCTION(int, ftruncate, (int at, off_t size), (at, size), kTruncate, at, NULL, -1)
FUNCTION(int, ftruncate64, (int at, off64_t size), (at, size), kTruncate, at, NULL, -1)
FUNCTION(int, fallocate, (int at, int mode, off_t from, off_t size), (at, mode, from, size), kTruncate, at, NULL, -1)
FUNCTION(int, posix_fallocate, (int at, off_t from, off_t size), (at, from, size), kTruncate, at, NULL, settings.error)
FUNCTION(int, fsync, (int at), (at), kFsync, at, NULL, -1)
FUNCTION(int, fdatasync, (int at), (at), kFsync, at, NULL, -1)
FUNCTION(int, flock, (int at, int what), (at, what), kLock, at, NULL, -1)

#define LOCK(name)                                                                                        \
  int name(int at, int what, ...) {                                                                       \
    va_list more;                                                                                         \
    va_start(more, what);                                                                                 \
    void* argument = va_arg(more, void*);                                                                 \
    va_end(more);                                                                                         \
    const int locks = what == F_SETLK || what == F_SETLKW || what == F_OFD_SETLK || what == F_OFD_SETLKW; \
    if (locks && fails(kLock, at, NULL)) return -1;                                                       \
    if ((what == F_DUPFD || what == F_DUPFD_CLOEXEC) && fails(kDup, at, NULL)) return -1;                 \
    return NEXT(name)(at, what, argument);                                                                \
  }
LOCK(fcntl)
LOCK(fcntl64)

// Memory without a file counts too, unless only files below a folder do.
FUNCTION(void*, mmap, (void* to, size_t size, int protection, int flags, int at, off_t from),
         (to, size, protection, flags, at, from), kMmap, at == -1 && settings.below ? AT_FDCWD : at,
         at == -1 && settings.below ? "/" : NULL, MAP_FAILED)
FUNCTION(void*, mmap64, (void* to, size_t size, int protection, int flags, int at, off64_t from),
         (to, size, protection, flags, at, from), kMmap, at == -1 && settings.below ? AT_FDCWD : at,
         at == -1 && settings.below ? "/" : NULL, MAP_FAILED)

FUNCTION(int, pthread_create,
         (pthread_t * thread, const pthread_attr_t* attributes, void* (*function)(void*), void* argument),
         (thread, attributes, function, argument), kThread, -1, NULL, settings.error)
FUNCTION(pid_t, fork, (void), (), kFork, -1, NULL, -1)
FUNCTION(int, posix_spawn,
         (pid_t * process, const char* path, const posix_spawn_file_actions_t* actions,
          const posix_spawnattr_t* attributes, char* const* arguments, char* const* environment),
         (process, path, actions, attributes, arguments, environment), kFork, -1, NULL, settings.error)
FUNCTION(int, posix_spawnp,
         (pid_t * process, const char* path, const posix_spawn_file_actions_t* actions,
          const posix_spawnattr_t* attributes, char* const* arguments, char* const* environment),
         (process, path, actions, attributes, arguments, environment), kFork, -1, NULL, settings.error)
FUNCTION(int, execv, (const char* path, char* const* arguments), (path, arguments), kExec, -1, NULL, -1)
FUNCTION(int, execve, (const char* path, char* const* arguments, char* const* environment),
         (path, arguments, environment), kExec, -1, NULL, -1)
FUNCTION(int, execvp, (const char* path, char* const* arguments), (path, arguments), kExec, -1, NULL, -1)
FUNCTION(int, fexecve, (int at, char* const* arguments, char* const* environment), (at, arguments, environment), kExec,
         -1, NULL, -1)
FUNCTION(int, pipe, (int ends[2]), (ends), kPipe, -1, NULL, -1)
FUNCTION(int, pipe2, (int ends[2], int flags), (ends, flags), kPipe, -1, NULL, -1)
FUNCTION(int, socketpair, (int domain, int type, int protocol, int ends[2]), (domain, type, protocol, ends), kPipe, -1,
         NULL, -1)
FUNCTION(int, dup, (int at), (at), kDup, at, NULL, -1)
FUNCTION(int, dup2, (int at, int to), (at, to), kDup, at, NULL, -1)
FUNCTION(int, dup3, (int at, int to, int flags), (at, to, flags), kDup, at, NULL, -1)
FUNCTION(int, poll, (struct pollfd * events, nfds_t count, int milliseconds), (events, count, milliseconds), kPoll, -1,
         NULL, -1)

// Memory asked for while a library is loaded is a call of its own: most of it is for tables that libraries fill at
// once.
static __thread int loading __attribute__((tls_model("initial-exec")));
static void loaded(int* before) { loading = *before; }

void* dlopen(const char* path, int flags) {
  __attribute__((cleanup(loaded))) int before = loading;  // also where an exception passes
  loading = 1;
  return NEXT(dlopen)(path, flags);
}

static int lacks_memory(void) { return fails(loading ? kLoaderMalloc : kMalloc, -1, NULL); }

// glibc's own names: dlsym itself asks for memory.
extern void* __libc_malloc(size_t);
extern void* __libc_calloc(size_t, size_t);
extern void* __libc_realloc(void*, size_t);
extern void* __libc_memalign(size_t, size_t);

void* malloc(size_t size) { return lacks_memory() ? NULL : __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return lacks_memory() ? NULL : __libc_calloc(count, size); }
void* realloc(void* data, size_t size) { return lacks_memory() ? NULL : __libc_realloc(data, size); }
void* memalign(size_t alignment, size_t size) { return lacks_memory() ? NULL : __libc_memalign(alignment, size); }
void* aligned_alloc(size_t alignment, size_t size) { return lacks_memory() ? NULL : __libc_memalign(alignment, size); }
int posix_memalign(void** data, size_t alignment, size_t size) {
  if (lacks_memory()) return ENOMEM;
  void* made = __libc_memalign(alignment, size);
  if (!made) return ENOMEM;
  *data = made;
  return 0;
}
