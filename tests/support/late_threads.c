/* Laid before the C library: the threads of llvmpipe are late to wake those who wait for a fence, as they are where
 * processors are scarce, and the process ends with status 3 if a fence goes away meanwhile. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <threads.h>
#include <unistd.h>

static _Atomic(void *) waking[256]; /* what each thread wakes the waiters of */
static atomic_int threads;
static __thread int own = -1; /* place in `waking`; 0 for all that are not llvmpipe's */
static __thread int calls;

static void begin(void *condition) {
    if (own < 0) {
        char name[16] = "";
        pthread_getname_np(pthread_self(), name, sizeof name);
        own = strstr(name, "llvmpipe") ? ++threads % 256 : 0;
    }
    if (own > 0) {
        waking[own] = condition;
        if (++calls % 4 == 0) usleep(500);
    }
}

static void end(void) {
    if (own > 0) waking[own] = NULL;
}

static void gone(void *condition) {
    for (int place = 1; place < 256; place++)
        if (waking[place] == condition) {
            static const char text[] = "a fence was freed that a thread still holds\n";
            write(2, text, sizeof text - 1);
            _exit(3);
        }
}

#define LATE(name, type, versioned)                                     \
    int name##_broadcast(type *condition) {                             \
        int (*next)(type *) = (int (*)(type *))versioned("_broadcast"); \
        begin(condition);                                               \
        int result = next(condition);                                   \
        end();                                                          \
        return result;                                                  \
    }

/* Before version 2.3.2 conditions were something else. */
#define POSIX(what) dlvsym(RTLD_NEXT, "pthread_cond" what, "GLIBC_2.3.2")
#define C11(what) dlsym(RTLD_NEXT, "cnd" what)

LATE(pthread_cond, pthread_cond_t, POSIX)
LATE(cnd, cnd_t, C11)

int pthread_cond_destroy(pthread_cond_t *condition) {
    gone(condition);
    return ((int (*)(pthread_cond_t *))POSIX("_destroy"))(condition);
}

void cnd_destroy(cnd_t *condition) {
    gone(condition);
    ((void (*)(cnd_t *))C11("_destroy"))(condition);
}
