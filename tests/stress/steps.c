/* Stands between the service and the C library (LD_PRELOAD) and sees every call that changes files below
 * CRASH_ROOT. It does what these variables ask for.
 *
 * CRASH_STEP=N, CRASH_ACTION=...: the Nth of these calls is a failure step.
 *     kill-before, kill-after   the process that calls dies before or after the call
 *     EIO, ENOSPC               the call, and all later ones within FAILING_MS, fail with this error
 *     delay                     the call takes DELAY_MS longer
 * CRASH_CLOCK=FILE: the clock of the process is wrong by the seconds in the file, a 64-bit integer.
 * CRASH_LOG=FILE: every sync is recorded with what it made durable, and every write to a database file.
 * CRASH_COUNT=FILE: the calls are counted in this file, a struct of two 64-bit integers (`count`).
 *
 * The service and its attempts at jobs share the log and the count. Attempts are processes with an empty
 * environment, so the library passes the variables on. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

/* Longer than SQLite and the service take for one request, shorter than the test's patience. */
enum { FAILING_MS = 300, DELAY_MS = 1500 };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static char root[4096];
static int64_t wanted_step;
static int log_fd = -1;
static const char *action;
/* Variables that an attempt gets from this process, if this process has them. */
enum { N_INHERITED = 6 };
static const char *const inherited[N_INHERITED] = {"LD_PRELOAD",  "CRASH_ROOT", "CRASH_LOG",
                                                   "CRASH_STEP", "CRASH_ACTION", "CRASH_COUNT"};
static char inherited_entries[N_INHERITED][4096];
static volatile int64_t *clock_error_s;
/* Calls so far, and the time of the monotonic clock until which calls fail. */
static struct count { int64_t n_steps, failing_until_ms; } own_count, *count = &own_count;
/* Whether this thread is in the failure step. */
static __thread int is_wanted;

typedef int clock_call(clockid_t, struct timespec *);

int clock_gettime(clockid_t clock, struct timespec *time) {
    static clock_call *real;
    if (real == NULL) real = (clock_call *)dlsym(RTLD_NEXT, "clock_gettime");
    int result = real(clock, time);
    if (clock == CLOCK_REALTIME && clock_error_s != NULL) time->tv_sec += *clock_error_s;
    return result;
}

static int64_t now_ns(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

/* Maps the begin of a file; NULL if there is none. */
static void *shared(const char *path, int mode, size_t n_bytes) {
    int fd = path == NULL ? -1 : open(path, mode | O_CLOEXEC);
    if (fd < 0) return NULL;
    void *begin = mmap(NULL, n_bytes, mode == O_RDWR ? PROT_READ | PROT_WRITE : PROT_READ, MAP_SHARED, fd, 0);
    close(fd);
    return begin == MAP_FAILED ? NULL : begin;
}

__attribute__((constructor)) static void begin(void) {
    const char *folder = getenv("CRASH_ROOT"), *step = getenv("CRASH_STEP"), *log = getenv("CRASH_LOG");
    action = getenv("CRASH_ACTION");
    clock_error_s = shared(getenv("CRASH_CLOCK"), O_RDONLY, sizeof *clock_error_s);
    struct count *shared_count = shared(getenv("CRASH_COUNT"), O_RDWR, sizeof *count);
    if (shared_count != NULL) count = shared_count;
    if (folder == NULL || realpath(folder, root) == NULL) root[0] = 0;
    if (step != NULL) wanted_step = atol(step);
    for (int k = 0; k < N_INHERITED; k++) {
        const char *value = getenv(inherited[k]);
        if (value != NULL) snprintf(inherited_entries[k], sizeof inherited_entries[k], "%s=%s", inherited[k], value);
    }
    if (log != NULL) log_fd = open(log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
}

static int is_below_root(const char *path) {
    size_t length = strlen(root);
    return length > 0 && strncmp(path, root, length) == 0 && (path[length] == '/' || path[length] == 0);
}

/* Writes the path of an open file, or an empty text. */
static void path_of(int fd, char *path, size_t size) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, size - 1);
    path[length < 0 ? 0 : length] = 0;
}

static int is_open_below_root(int fd) {
    char path[4096];
    path_of(fd, path, sizeof path);
    return is_below_root(path);
}

static int is_path_below_root(int folder, const char *path) {
    if (path[0] == '/') return is_below_root(path);
    return folder != AT_FDCWD && is_open_below_root(folder);
}

/* Counts a call. Returns 0, or the error with which it must fail. */
static int enter(void) {
    int64_t step = __atomic_add_fetch(&count->n_steps, 1, __ATOMIC_SEQ_CST);
    is_wanted = step == wanted_step && action != NULL;
    if (action == NULL) return 0;
    if (is_wanted && strcmp(action, "kill-before") == 0) kill(getpid(), SIGKILL);
    if (is_wanted && strcmp(action, "delay") == 0) usleep(DELAY_MS * 1000);
    if (action[0] != 'E') return 0;
    int64_t now_ms = now_ns(CLOCK_MONOTONIC) / 1000000;
    if (is_wanted) __atomic_store_n(&count->failing_until_ms, now_ms + FAILING_MS, __ATOMIC_SEQ_CST);
    if (now_ms >= __atomic_load_n(&count->failing_until_ms, __ATOMIC_SEQ_CST)) return 0;
    return strcmp(action, "ENOSPC") == 0 ? ENOSPC : EIO;
}

static void leave(void) {
    if (is_wanted && strcmp(action, "kill-after") == 0) kill(getpid(), SIGKILL);
}

/* One record: header, path, data. */
struct header {
    int64_t time_ns;
    uint64_t inode;
    int64_t offset;
    uint32_t path_bytes;
    uint32_t data_bytes;
    char kind[8];
};

static void record(const char *kind, int fd, int64_t offset, const void *data, size_t n_bytes) {
    char path[4096];
    struct stat about;
    path_of(fd, path, sizeof path);
    if (fstat(fd, &about) != 0) return;
    struct header header = {now_ns(CLOCK_REALTIME), about.st_ino, offset, strlen(path), n_bytes, ""};
    strncpy(header.kind, kind, sizeof header.kind);
    struct iovec parts[] = {{&header, sizeof header}, {path, strlen(path)}, {(void *)data, n_bytes}};
    static ssize_t (*real)(int, const struct iovec *, int);
    if (real == NULL) real = dlsym(RTLD_NEXT, "writev");
    size_t all = sizeof header + strlen(path) + n_bytes;
    if (real(log_fd, parts, 3) != (ssize_t)all) abort();
}

/* Records the whole content of a synced file, or the entries of a synced folder as lines "inode name". */
static void record_sync(int fd) {
    struct stat about;
    char path[4096];
    path_of(fd, path, sizeof path);
    if (fstat(fd, &about) != 0) return;
    if (!S_ISDIR(about.st_mode)) {
        char *content = malloc(about.st_size + 1);
        ssize_t n_bytes = pread(fd, content, about.st_size, 0);
        /* Only files that are open for writing alone are opened again: closing a database file would
         * release SQLite's locks. */
        if (n_bytes < 0) {
            int own = open(path, O_RDONLY | O_CLOEXEC);
            n_bytes = pread(own, content, about.st_size, 0);
            close(own);
        }
        if (n_bytes >= 0) record("file", fd, 0, content, n_bytes);
        free(content);
        return;
    }
    DIR *folder = opendir(path);
    char *lines = NULL;
    size_t n_bytes = 0;
    FILE *list = open_memstream(&lines, &n_bytes);
    for (struct dirent *entry; folder != NULL && (entry = readdir(folder)) != NULL;)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            fprintf(list, "%llu %d %s\n", (unsigned long long)entry->d_ino, entry->d_type == DT_DIR, entry->d_name);
    fclose(list);
    if (folder != NULL) {
        record("folder", fd, 0, lines, n_bytes);
        closedir(folder);
    }
    free(lines);
}

static int is_database(int fd) {
    char path[4096];
    path_of(fd, path, sizeof path);
    return strstr(path, "/flockreel.db") != NULL && strstr(path, "-shm") == NULL;
}

#define REAL(type, name, ...)                                       \
    static type (*real)(__VA_ARGS__);                               \
    if (real == NULL) real = (type(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name)

/* Makes a call that is a step: it may fail, and the process may die before or after it. While a log is
 * written, calls that are recorded take turns, so that the log has their order. */
#define STEP(is_ours, call, recording)                              \
    if (!(is_ours)) return call;                                    \
    int error = enter();                                            \
    if (error != 0) { errno = error; return -1; }                   \
    if (log_fd >= 0) pthread_mutex_lock(&lock);                     \
    __typeof__(call) result = call;                                 \
    int number = errno;                                             \
    if (log_fd >= 0) { if (result >= 0) { recording; } pthread_mutex_unlock(&lock); } \
    leave();                                                        \
    errno = number;                                                 \
    return result

int fsync(int fd) {
    REAL(int, "fsync", int);
    STEP(is_open_below_root(fd), real(fd), record_sync(fd));
}

int fdatasync(int fd) {
    REAL(int, "fdatasync", int);
    STEP(is_open_below_root(fd), real(fd), record_sync(fd));
}

ssize_t pwrite64(int fd, const void *data, size_t n_bytes, off64_t offset) {
    REAL(ssize_t, "pwrite64", int, const void *, size_t, off64_t);
    STEP(is_open_below_root(fd), real(fd, data, n_bytes, offset),
         if (is_database(fd)) record("write", fd, offset, data, result));
}

ssize_t pwrite(int fd, const void *data, size_t n_bytes, off_t offset) { return pwrite64(fd, data, n_bytes, offset); }

int ftruncate64(int fd, off64_t length) {
    REAL(int, "ftruncate64", int, off64_t);
    STEP(is_open_below_root(fd), real(fd, length), if (is_database(fd)) record("cut", fd, length, "", 0));
}

int ftruncate(int fd, off_t length) { return ftruncate64(fd, length); }

ssize_t write(int fd, const void *data, size_t n_bytes) {
    REAL(ssize_t, "write", int, const void *, size_t);
    STEP(is_open_below_root(fd), real(fd, data, n_bytes), (void)0);
}

int rename(const char *from, const char *to) {
    REAL(int, "rename", const char *, const char *);
    STEP(is_path_below_root(AT_FDCWD, to), real(from, to), (void)0);
}

int unlink(const char *path) {
    REAL(int, "unlink", const char *);
    STEP(is_path_below_root(AT_FDCWD, path), real(path), (void)0);
}

int unlinkat(int folder, const char *path, int flags) {
    REAL(int, "unlinkat", int, const char *, int);
    STEP(is_path_below_root(folder, path), real(folder, path, flags), (void)0);
}

int rmdir(const char *path) {
    REAL(int, "rmdir", const char *);
    STEP(is_path_below_root(AT_FDCWD, path), real(path), (void)0);
}

int mkdir(const char *path, mode_t mode) {
    REAL(int, "mkdir", const char *, mode_t);
    STEP(is_path_below_root(AT_FDCWD, path), real(path, mode), (void)0);
}

int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags) {
    REAL(int, "linkat", int, const char *, int, const char *, int);
    STEP(is_path_below_root(to_folder, to), real(from_folder, from, to_folder, to, flags), (void)0);
}

/* Returns the environment of a new process: an attempt at a job also gets the inherited variables. May run between
 * fork and exec, so it allocates nothing. */
static char **environment_of(char *const arguments[], char **given) {
    static char *entries[64];
    int is_attempt = 0, n = 0;
    for (int k = 0; arguments[k] != NULL; k++) is_attempt |= strcmp(arguments[k], "attempt") == 0;
    if (root[0] == 0 || !is_attempt) return given;
    for (int k = 0; k < N_INHERITED; k++)
        if (inherited_entries[k][0] != 0) entries[n++] = inherited_entries[k];
    for (; given != NULL && *given != NULL && n < 63; given++) entries[n++] = *given;
    entries[n] = NULL;
    return entries;
}

int execvp(const char *program, char *const arguments[]) {
    REAL(int, "execvp", const char *, char *const[]);
    environ = environment_of(arguments, environ);
    return real(program, arguments);
}

int posix_spawnp(pid_t *pid, const char *program, const posix_spawn_file_actions_t *actions,
                 const posix_spawnattr_t *attributes, char *const arguments[], char *const given[]) {
    REAL(int, "posix_spawnp", pid_t *, const char *, const posix_spawn_file_actions_t *, const posix_spawnattr_t *,
         char *const[], char *const[]);
    return real(pid, program, actions, attributes, arguments, environment_of(arguments, (char **)given));
}
