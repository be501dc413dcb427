/* jf_NAME_work allocates nothing and starts no thread: the allocator of the whole process, and what starts threads, are
   counted here, for the run-time libraries of Fortran and OpenMP and for LAPACK as well. */
#define _GNU_SOURCE
#include <complex.h>
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calls.h"

#define LINES 12

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
extern void __libc_free(void *);

static _Atomic long count;

void *malloc(size_t bytes)
{
    count++;
    return __libc_malloc(bytes);
}

void *calloc(size_t n, size_t bytes)
{
    count++;
    return __libc_calloc(n, bytes);
}

void *realloc(void *memory, size_t bytes)
{
    count++;
    return __libc_realloc(memory, bytes);
}

void *memalign(size_t boundary, size_t bytes)
{
    count++;
    return __libc_memalign(boundary, bytes);
}

void *aligned_alloc(size_t boundary, size_t bytes)
{
    return memalign(boundary, bytes);
}

int posix_memalign(void **memory, size_t boundary, size_t bytes)
{
    *memory = memalign(boundary, bytes);
    return *memory == NULL ? ENOMEM : 0;
}

void free(void *memory)
{
    count += memory != NULL;
    __libc_free(memory);
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*start)(void *), void *argument)
{
    int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);

    count++;
    *(void **)&real = dlsym(RTLD_NEXT, "pthread_create");
    return real(thread, attributes, start, argument);
}

static void expect_none(long before, const problem *p, const char *when)
{
    if (count == before)
        return;
    failures++;
    fprintf(stderr, "FAILED: %s, %c, order %d, %s: %ld times\n", routine_name[p->routine], p->trans, (int)p->size[0],
            when, count - before);
}

/* A query, all lines, and a refused call. */
static void count_one(const problem *p, outcome *o)
{
    jf_complex length;
    jf_int integers;
    workspace asked = {&length, -1, &integers, -1}, space;
    long before = count;

    call_into(p, &asked, o);
    expect_none(before, p, "query");
    space.lwork = (jf_int)creal(length);
    space.liwork = integers;
    space.work = malloc((size_t)space.lwork * sizeof(jf_complex));
    space.iwork = malloc((size_t)integers * sizeof(jf_int));
    before = count;
    call_into(p, &space, o);
    expect_none(before, p, "lines");
    if (o->info < 0) {
        failures++;
        fprintf(stderr, "FAILED: %s: info %d\n", routine_name[p->routine], (int)o->info);
    }
    space.lwork--;
    before = count;
    call_into(p, &space, o);
    expect_none(before, p, "refused");
    free(space.work);
    free(space.iwork);
}

int main(void)
{
    static const int orders[] = {0, 1, 2, 3, 6, 40, 100};
    const char *const spoiled[2] = {"", " n 0sh i tlm"};
    int routine, i, t, variant, bad, line;
    problem p = new_problem(INVERT, 'N', 40, LINES, 0);
    outcome o = new_outcome(&p);
    long before;

    /* OpenBLAS takes its buffers at the first call and keeps them. */
    call_into(&p, NULL, &o);
    free_outcome(&o);
    free_problem(&p);
    for (routine = 0; routine < WORK_ROUTINES; routine++)
        for (i = 0; i < 7; i++)
            for (t = 0; t < 2; t++)
                for (variant = 0; variant < variants(routine); variant++)
                    for (bad = 0; bad < 2; bad++) {
                        if (orders[i] > 6 && routine == COMPLIANCE_COVARIANCE)
                            continue;
                        p = new_problem(routine, "NT"[t], orders[i], LINES, variant);
                        o = new_outcome(&p);
                        for (line = 0; spoiled[bad][line] != '\0' && orders[i] > 0; line++)
                            if (spoiled[bad][line] != ' ')
                                spoil(&p, line, spoiled[bad][line]);
                        count_one(&p, &o);
                        free_outcome(&o);
                        free_problem(&p);
                    }

    /* The counter moves where something is allocated. */
    p = new_problem(COUPLE, 'N', 3, LINES, 0);
    o = new_outcome(&p);
    before = count;
    call_into(&p, NULL, &o);
    if (count == before) {
        failures++;
        fprintf(stderr, "FAILED: jf_couple was not seen to allocate\n");
    }
    free_outcome(&o);
    free_problem(&p);
    return failures != 0;
}
