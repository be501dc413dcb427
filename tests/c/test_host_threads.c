/* Threads of the host call at the same time, each its own problems by all routines, with and without memory of its own,
   some with bad lines: the bits are those of the same calls one after the other. Threads of OpenMP, nested or not, and
   of POSIX. */
#include <complex.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef _OPENMP
#include <omp.h>
#endif

#include "calls.h"

#define THREADS 4
#define ROUNDS 3
#define LINES 40        /* at the largest order enough for two threads of the kernel */
#define MOST (6 * ROUTINES)

typedef struct {
    problem p;
    outcome expected;
    workspace w;        /* work is NULL: without */
} task;

static task tasks[MOST];
static int n_tasks;
static jf_int engine_chosen;
static _Atomic int failed, calls;

static void fail(const char *claim, const problem *p)
{
    failed++;
    fprintf(stderr, "FAILED: %s: %s, order %d, engine %d\n", claim, routine_name[p->routine], (int)p->size[0],
            (int)engine_chosen);
}

static void new_task(int routine, int n, int with_memory)
{
    static const char kinds[] = "n0shitlm";
    task *k = &tasks[n_tasks];
    int line;

    k->p = new_problem(routine, "NT"[n_tasks % 2], n, LINES, n_tasks % variants(routine));
    for (line = 0; line < LINES && n_tasks % 3 == 0; line += 5)
        spoil(&k->p, line, kinds[line / 5]);
    k->expected = new_outcome(&k->p);
    k->w.work = NULL;
    if (with_memory) {
        jf_complex length;
        jf_int integers;
        const workspace asked = {&length, -1, &integers, -1};

        call_into(&k->p, &asked, &k->expected);
        k->w.lwork = (jf_int)creal(length);
        k->w.liwork = integers;
        k->w.work = malloc((size_t)k->w.lwork * sizeof(jf_complex));
        k->w.iwork = malloc((size_t)k->w.liwork * sizeof(jf_int));
        clear(&k->expected);
    }
    call_into(&k->p, with_memory ? &k->w : NULL, &k->expected);
    if (k->expected.info < 0 || !guards_stay(&k->expected))
        fail("a call by itself", &k->p);
    n_tasks++;
}

static void new_tasks(void)
{
    static const int orders[] = {2, 5, 12};
    int routine, i;

    n_tasks = 0;
    for (routine = 0; routine < ROUTINES; routine++)
        for (i = 0; i < (routine == COMPLIANCE_COVARIANCE || routine == MONTE_CARLO || routine == PROJECT_ON_JOINT
                         || routine == JOINT_FORMS || routine == EXPECT_ON_JOINT || routine == FIT_JOINT ? 1 : 3); i++) {
            new_task(routine, orders[i], 0);
            if (routine < WORK_ROUTINES)
                new_task(routine, orders[i], 1);
        }
}

static void free_tasks(void)
{
    int i;

    for (i = 0; i < n_tasks; i++) {
        free_problem(&tasks[i].p);
        free_outcome(&tasks[i].expected);
        if (tasks[i].w.work != NULL) {
            free(tasks[i].w.work);
            free(tasks[i].w.iwork);
        }
    }
}

/* The tasks of one thread, in its own order. Those with memory belong to one thread; of the others each has all. */
static void work_through(int thread)
{
    int round, i;

    for (round = 0; round < ROUNDS; round++)
        for (i = 0; i < n_tasks; i++) {
            const int at = ((thread % 2 ? n_tasks - i : i) + 17 * thread + 29 * round) % n_tasks;
            const task *k = &tasks[at];
            jf_int engine, info, version[3];
            outcome o;

            if (k->w.work != NULL ? at % THREADS != thread : (at + round) % 2 != 0)
                continue;
            o = new_outcome(&k->p);
            call_into(&k->p, k->w.work != NULL ? &k->w : NULL, &o);
            if (!same(&o, &k->expected))
                fail("not the bits of the call by itself", &k->p);
            free_outcome(&o);
            jf_get_engine(&engine, &info);
            jf_version(version, version + 1, version + 2);
            if (info != 0 || engine != engine_chosen || version[0] < 0)
                fail("engine in use", &k->p);
            calls++;
        }
}

static void *posix_thread(void *number)
{
    work_through(*(int *)number);
    return NULL;
}

static void threads_of_posix(void)
{
    static int numbers[THREADS] = {0, 1, 2, 3};
    pthread_t threads[THREADS];
    int i;

    for (i = 0; i < THREADS; i++)
        if (pthread_create(&threads[i], NULL, posix_thread, &numbers[i]) != 0)
            exit(2);
    for (i = 0; i < THREADS; i++)
        pthread_join(threads[i], NULL);
}

static void threads_of_openmp(int levels)
{
#ifdef _OPENMP
    omp_set_max_active_levels(levels);
#pragma omp parallel num_threads(THREADS)
    {
        if (omp_get_num_threads() == THREADS)
            work_through(omp_get_thread_num());
    }
    omp_set_max_active_levels(1);
#else
    (void)levels;
#endif
}

int main(void)
{
    jf_int engine, info;

    for (engine = JF_ENGINE_LAPACK; engine <= JF_ENGINE_X86_64_V4; engine++) {
        jf_set_engine(&engine, &info);
        if (info != 0)
            continue;
        engine_chosen = engine;
        new_tasks();
        threads_of_openmp(1);
        threads_of_openmp(2);
        threads_of_posix();
        free_tasks();
    }
    printf("host_threads: %d calls, %d failed\n", calls, failed);
    return failed != 0 || calls == 0;
}
