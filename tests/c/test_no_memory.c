/* Each allocation of a call fails in turn, for every routine, engine and kind of order: the call returns -1000 (or does
   without that memory), has written nothing, keeps nothing, and the next call is right. What the kernel and the run-time
   library of Fortran ask for fails; what OpenMP, LAPACK and the C library ask for does not, see docs/embedding.md.
   With two threads, those of OpenMP cannot be started either: the call takes one.

   no_memory [long]   long: more orders, numbers of lines and variants of arguments; minutes */
#define _GNU_SOURCE
#include <errno.h>
#include <dlfcn.h>
#include <link.h>
#include <pthread.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#ifdef _OPENMP
#include <omp.h>
#endif

#include "calls.h"

#define MOST_RANGES 64
#define MOST_HELD 20000

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
extern void __libc_free(void *);

/* Code whose allocations fail: of this program, which holds the kernel, and of the run-time library of Fortran. */
static uintptr_t ours[MOST_RANGES][2];
static int n_ours;

static volatile int armed;             /* during a call */
static long count, fail_at;            /* allocations of a call; the one that fails, 0 for none */
static int no_threads;
static void *held[MOST_HELD];          /* what a call has not given back */
static int n_held;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static int add_ranges(struct dl_phdr_info *info, size_t size, void *unused)
{
    int i;

    (void)size;
    (void)unused;
    if (info->dlpi_name[0] != '\0' && strstr(info->dlpi_name, "libgfortran") == NULL)
        return 0;
    for (i = 0; i < info->dlpi_phnum && n_ours < MOST_RANGES; i++)
        if (info->dlpi_phdr[i].p_type == PT_LOAD && (info->dlpi_phdr[i].p_flags & PF_X) != 0) {
            ours[n_ours][0] = info->dlpi_addr + info->dlpi_phdr[i].p_vaddr;
            ours[n_ours][1] = ours[n_ours][0] + info->dlpi_phdr[i].p_memsz;
            n_ours++;
        }
    return 0;
}

/* Whether this allocation is one of the call's, and has to fail. */
static int is_ours(const void *caller)
{
    int i;

    for (i = 0; armed && i < n_ours; i++)
        if ((uintptr_t)caller >= ours[i][0] && (uintptr_t)caller < ours[i][1])
            return 1;
    return 0;
}

static int fails(void)
{
    int now;

    pthread_mutex_lock(&lock);
    now = ++count == fail_at;
    pthread_mutex_unlock(&lock);
    if (now)
        errno = ENOMEM;
    return now;
}

static void *hold(void *memory)
{
    if (memory == NULL)
        return memory;
    pthread_mutex_lock(&lock);
    if (n_held < MOST_HELD)
        held[n_held++] = memory;
    pthread_mutex_unlock(&lock);
    return memory;
}

static void let_go(const void *memory)
{
    int i;

    pthread_mutex_lock(&lock);
    for (i = n_held - 1; i >= 0; i--)
        if (held[i] == memory) {
            held[i] = held[--n_held];
            break;
        }
    pthread_mutex_unlock(&lock);
}

void *malloc(size_t bytes)
{
    if (!is_ours(__builtin_return_address(0)))
        return __libc_malloc(bytes);
    return fails() ? NULL : hold(__libc_malloc(bytes));
}

void *calloc(size_t n, size_t bytes)
{
    if (!is_ours(__builtin_return_address(0)))
        return __libc_calloc(n, bytes);
    return fails() ? NULL : hold(__libc_calloc(n, bytes));
}

void *realloc(void *memory, size_t bytes)
{
    if (!is_ours(__builtin_return_address(0)))
        return __libc_realloc(memory, bytes);
    if (fails())
        return NULL;
    let_go(memory);
    return hold(__libc_realloc(memory, bytes));
}

void *memalign(size_t boundary, size_t bytes)
{
    if (!is_ours(__builtin_return_address(0)))
        return __libc_memalign(boundary, bytes);
    return fails() ? NULL : hold(__libc_memalign(boundary, bytes));
}

void *aligned_alloc(size_t boundary, size_t bytes)
{
    if (!is_ours(__builtin_return_address(0)))
        return __libc_memalign(boundary, bytes);
    return fails() ? NULL : hold(__libc_memalign(boundary, bytes));
}

int posix_memalign(void **memory, size_t boundary, size_t bytes)
{
    if (is_ours(__builtin_return_address(0)) && fails())
        return ENOMEM;
    *memory = __libc_memalign(boundary, bytes);
    if (is_ours(__builtin_return_address(0)))
        hold(*memory);
    return *memory == NULL ? ENOMEM : 0;
}

void free(void *memory)
{
    if (armed && memory != NULL)
        let_go(memory);
    __libc_free(memory);
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*start)(void *), void *argument)
{
    int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);

    if (no_threads)
        return EAGAIN;
    *(void **)&real = dlsym(RTLD_NEXT, "pthread_create");
    return real(thread, attributes, start, argument);
}

/* The host came to an end. */
static void ended(const char *how)
{
    static const char claim[] = "FAILED: the program was ended: ";

    armed = 0;
    if (write(STDERR_FILENO, claim, sizeof claim - 1) < 0 || write(STDERR_FILENO, what, strlen(what)) < 0
        || write(STDERR_FILENO, how, strlen(how)) < 0)
        _exit(2);
    _exit(1);
}

static void stopped(int number)
{
    (void)number;
    ended(", by a signal\n");
}

static void left(void)
{
    if (armed)
        ended(", by exit()\n");
}

static long total, refused;

static void arm(long which)
{
    count = 0;
    fail_at = which;
    n_held = 0;
    armed = 1;
}

/* A call while allocation `which` fails; 0 where there is none of that number. */
static int fail_one(const problem *p, const outcome *expected, const outcome *before, long which)
{
    outcome o = new_outcome(p);
    const size_t length = strlen(what);
    long made;

    snprintf(what + length, sizeof what - length, " allocation %ld", which);
    begin(p, o.out);
    arm(which);
    o.info = call(p, NULL, o.out, o.line_info, o.rcond);
    armed = 0;
    made = count;
    check(n_held == 0, "memory is kept");
    if (made >= which) {
        total++;
        refused += o.info == JF_INFO_NO_MEMORY;
        if (o.info == JF_INFO_NO_MEMORY)
            check(memcmp(o.bytes, before->bytes, o.n_bytes) == 0, "results are written without memory");
        else
            check(same(&o, expected), "neither -1000 nor the right results");
    }
    what[length] = '\0';
    free_outcome(&o);
    return made >= which;
}

static void every_allocation(const problem *p, jf_int engine)
{
    outcome expected = new_outcome(p), before = new_outcome(p), after = new_outcome(p);
    long which;

    snprintf(what, sizeof what, "%s %c n=%d lines=%d engine=%d", routine_name[p->routine], p->trans, (int)p->size[0],
             (int)p->n_freq, (int)engine);
    begin(p, before.out);
    call_into(p, NULL, &expected);
    /* Of order 0 there are no joints, weights or realisations: the argument is refused. */
    check(expected.info >= 0 || (p->size[0] == 0 && expected.info > JF_INFO_NO_MEMORY), "a call with memory");
    for (which = 1; fail_one(p, &expected, &before, which); which++)
        ;
    call_into(p, NULL, &after);
    check(same(&after, &expected), "the call after those that failed");
    free_outcome(&expected);
    free_outcome(&before);
    free_outcome(&after);
}

static int too_large(int routine, int n)
{
    switch (routine) {
    case BRICK_MATRICES: case BRICK_QUALITY: return n > 1;
    case PROJECT_ON_JOINT: case JOINT_FORMS: case EXPECT_ON_JOINT: case FIT_JOINT: return n > 3;
    case COMPLIANCE_COVARIANCE: return n > 5;
    case MONTE_CARLO: return n > 40;
    default: return 0;
    }
}

static void every_routine(jf_int engine, const int *orders, int n_orders, const int *lines, int n_lines, int all_variants)
{
    int routine, i, k, variant;

    for (routine = 0; routine < ROUTINES; routine++)
        for (i = 0; i < n_orders; i++)
            for (k = 0; k < n_lines; k++)
                for (variant = 0; variant < variants(routine) && !too_large(routine, orders[i]); variant++) {
                    problem p;

                    if (!all_variants && variant != (i + k) % variants(routine))
                        continue;
                    p = new_problem(routine, "NT"[(i + k + variant) % 2], orders[i], lines[k], variant);
                    every_allocation(&p, engine);
                    free_problem(&p);
                }
}

#ifdef _OPENMP
/* No thread can be started: OpenMP would end the program. To be called by a thread that has not called OpenMP yet. */
static void *without_threads(void *engine)
{
    int routine;

    for (routine = 0; routine < ROUTINES; routine++) {
        const int small = routine == COMPLIANCE_COVARIANCE || routine == MONTE_CARLO || routine == PROJECT_ON_JOINT
                          || routine == JOINT_FORMS || routine == EXPECT_ON_JOINT || routine == FIT_JOINT;
        problem p = new_problem(routine, 'N', small ? 3 : 9, 500, 0);
        outcome o = new_outcome(&p), expected = new_outcome(&p);
        const int threads = omp_get_max_threads();

        snprintf(what, sizeof what, "%s engine=%d, threads cannot be started", routine_name[routine],
                 (int)*(jf_int *)engine);
        no_threads = armed = 1;
        n_held = 0;
        count = 0;
        fail_at = 0;
        call_into(&p, NULL, &o);
        armed = no_threads = 0;
        omp_set_num_threads(1);
        call_into(&p, NULL, &expected);
        omp_set_num_threads(threads);
        check(o.info >= 0 && same(&o, &expected), "the results of one thread");
        free_outcome(&o);
        free_outcome(&expected);
        free_problem(&p);
    }
    return NULL;
}
#endif

/* The first call of a process asks the environment for the engine. */
static void first_call(void)
{
    problem p = new_problem(INVERT, 'N', 3, 3, 0);
    outcome o = new_outcome(&p);

    snprintf(what, sizeof what, "the first call");
    arm(1);
    o.info = call(&p, NULL, o.out, o.line_info, o.rcond);
    armed = 0;
    check(o.info == JF_INFO_NO_MEMORY && untouched(&o), "-1000");
    free_outcome(&o);
    free_problem(&p);
}

int main(int argc, char **argv)
{
    static const int few[] = {1, 2, 3, 7, 24}, many[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 24, 40, 70, 100};
    static const int few_lines[] = {3, 20}, many_lines[] = {1, 2, 3, 20, 100}, threaded[] = {500}, middle[] = {9};
    const int full = argc > 1 && strcmp(argv[1], "long") == 0;
    struct sigaction action = {.sa_handler = stopped};
    jf_int engine, info;

    sigaction(SIGSEGV, &action, NULL);
    sigaction(SIGBUS, &action, NULL);
    sigaction(SIGABRT, &action, NULL);
    atexit(left);
    dl_iterate_phdr(add_ranges, NULL);
    first_call();
    for (engine = JF_ENGINE_LAPACK; engine <= JF_ENGINE_X86_64_V4; engine++) {
        jf_set_engine(&engine, &info);
        if (info != 0)
            continue;
#ifdef _OPENMP
        if (omp_get_max_threads() > 1) {
            pthread_t thread;

            if (pthread_create(&thread, NULL, without_threads, &engine) != 0)
                return 2;
            pthread_join(thread, NULL);
            every_routine(engine, middle, 1, threaded, 1, full);
        }
#endif
        if (full)
            every_routine(engine, many, 15, many_lines, 5, 1);
        else
            every_routine(engine, few, 5, few_lines, 2, 0);
    }
    printf("no_memory: %ld allocations failed, %ld calls returned -1000; %d checks, %d failed\n", total, refused, checks,
           failures);
    return failures != 0 || refused == 0;
}
