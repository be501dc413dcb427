/* Every routine on a thread of the host with no more stack than docs/embedding.md asks for, up to the largest orders that
   are computed side by side and beyond.

   stack [KILOBYTES] */
#define _GNU_SOURCE
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <signal.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "calls.h"

#define LEAST 384       /* kilobytes that docs/embedding.md names */

static void stopped(int number)
{
    static const char claim[] = "FAILED: the stack is too small: ";

    if (write(STDERR_FILENO, claim, sizeof claim - 1) < 0 || write(STDERR_FILENO, what, strlen(what)) < 0
        || write(STDERR_FILENO, "\n", 1) < 0)
        number = 0;
    _exit(number != 0 ? 1 : 2);
}

typedef struct {
    const problem *p;
    const workspace *w;
    outcome *o;
    stack_t signals;
} task;

static void *run(void *argument)
{
    const task *t = argument;

    sigaltstack(&t->signals, NULL);
    call_into(t->p, t->w, t->o);
    return NULL;
}

static int too_large(int routine, int n)
{
    switch (routine) {
    case BRICK_MATRICES: case BRICK_QUALITY: return n > 2;
    case PROJECT_ON_JOINT: case JOINT_FORMS: case EXPECT_ON_JOINT: case FIT_JOINT: return n > 3;
    case COMPLIANCE_COVARIANCE: case JOINT_NORMAL_EQUATIONS: return n > 8;
    case MONTE_CARLO: return n > 33;
    case FIT_DIAGONAL_JOINT: case LOWEST_DIAGONAL_JOINT: case RATIONAL_FIT: case RELOCATE_POLES: case SMOOTH_FRFS:
        return n > 64;
    default: return 0;
    }
}

int main(int argc, char **argv)
{
    static const int orders[] = {1, 2, 3, 6, 8, 24, 33, 64, 70, 128};
    static const int lines[] = {20, 1};     /* a single line may take threads of the BLAS, which need more */
    const size_t bytes = 1024 * (size_t)(argc > 1 ? atoi(argv[1]) : LEAST);
    struct sigaction action = {.sa_handler = stopped, .sa_flags = SA_ONSTACK};
    pthread_attr_t small;
    jf_int engine, info;
    int routine, i, k, variant, calls_made = 0, kinds = 2;
    task t;

#ifdef _OPENMP
    if (omp_get_max_threads() > 1)
        kinds = 1;
#endif
    t.signals = (stack_t){.ss_sp = malloc(65536), .ss_size = 65536};
    sigaction(SIGSEGV, &action, NULL);
    sigaction(SIGBUS, &action, NULL);
    pthread_attr_init(&small);
    if (pthread_attr_setstacksize(&small, bytes) != 0)
        return 2;
    for (engine = JF_ENGINE_LAPACK; engine <= JF_ENGINE_X86_64_V4; engine++) {
        jf_set_engine(&engine, &info);
        if (info != 0)
            continue;
        for (routine = 0; routine < ROUTINES; routine++)
            for (i = 0; i < 10; i++)
                for (k = 0; k < kinds; k++)
                    for (variant = 0; variant < variants(routine); variant++) {
                        problem p;
                        outcome o;
                        pthread_t thread;

                        if (too_large(routine, orders[i]) || (orders[i] > 8 && variant != i % variants(routine)))
                            continue;
                        p = new_problem(routine, "NT"[i % 2], orders[i], lines[k], variant);
                        o = new_outcome(&p);
                        snprintf(what, sizeof what, "%s n=%d lines=%d engine=%d", routine_name[routine], orders[i],
                                 lines[k], (int)engine);
                        t.p = &p;
                        t.w = NULL;
                        t.o = &o;
                        if (pthread_create(&thread, &small, run, &t) != 0)
                            return 2;
                        pthread_join(thread, NULL);
                        check(o.info >= 0 && guards_stay(&o), "a call on a small stack");
                        calls_made++;
                        free_outcome(&o);
                        free_problem(&p);
                    }
    }
    printf("stack: %d calls on %zu kilobytes, %d failed\n", calls_made, bytes / 1024, failures);
    return failures != 0;
}
