/* A program that stops at floating-point exceptions calls every routine: with lines that are good, singular, not
   finite, or near overflow and underflow, each engine, one thread and two. Nothing stops, the bits are those without
   traps, and traps, flags, rounding and modes are afterwards what they were, in OpenMP's threads too. */
#define _GNU_SOURCE
#include <fenv.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#ifdef _OPENMP
#include <omp.h>
#endif
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "calls.h"

#define LINES 25
#define MANY_LINES 500  /* worth two threads */
#define ALL (FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW | FE_UNDERFLOW | FE_INEXACT)

static void stopped(int number)
{
    static const char claim[] = "FAILED: stopped by an exception: ";

    if (write(STDERR_FILENO, claim, sizeof claim - 1) < 0 || write(STDERR_FILENO, what, strlen(what)) < 0
        || write(STDERR_FILENO, "\n", 1) < 0)
        number = 0;
    _exit(number != 0 ? 1 : 2);
}

/* The floating-point state of this thread. */
typedef struct {
    int traps, flags, rounding;
    unsigned modes;
} state;

static state now(void)
{
    state s = {fegetexcept(), fetestexcept(FE_ALL_EXCEPT), fegetround(), 0};

#if defined(__x86_64__)
    s.modes = _mm_getcsr();
#endif
    return s;
}

static int as_before(const state *a)
{
    const state b = now();

    return a->traps == b.traps && a->flags == b.flags && a->rounding == b.rounding && a->modes == b.modes;
}

static void all_traps(int on)
{
    feclearexcept(FE_ALL_EXCEPT);
    if (on)
        feenableexcept(ALL);
    else
        fedisableexcept(ALL);
}

/* Lines of every kind among good ones. */
static void spoil_some(problem *p)
{
    static const char kinds[] = "n0shitlmi";
    int k;

    for (k = 0; k < (int)sizeof kinds - 1; k++)
        spoil(p, 2 + 2 * k + k / 4, kinds[k]);
}

static void spoil_all(problem *p, char kind)
{
    int line;

    for (line = 0; line < p->n_freq; line++)
        spoil(p, line, kind);
}

/* The same with and without traps, and with the rounding of the host as with rounding to the nearest. */
static void compare(const problem *p)
{
    outcome expected = new_outcome(p), o = new_outcome(p);
    const int rounding = fegetround();
    state before;

    fesetround(FE_TONEAREST);
    call_into(p, NULL, &expected);
    fesetround(rounding);
    all_traps(1);
    before = now();
    call_into(p, NULL, &o);
    check(as_before(&before), "state with traps");
    all_traps(0);
    check(same(&o, &expected), "the bits without traps");
    free_outcome(&expected);
    free_outcome(&o);
}

/* The same in memory of the caller: query, lines, and a refused length. */
static void compare_in_memory(const problem *p)
{
    outcome expected = new_outcome(p), o = new_outcome(p);
    jf_complex length[1];
    jf_int integers[1];
    workspace w = {length, -1, integers, -1};
    state before;

    all_traps(1);
    before = now();
    call_into(p, &w, &o);
    check(as_before(&before), "state after a query");
    all_traps(0);
    w.lwork = (jf_int)((double *)length)[0];
    w.liwork = integers[0];
    w.work = calloc((size_t)w.lwork, sizeof(jf_complex));
    w.iwork = calloc((size_t)w.liwork, sizeof(jf_int));
    call_into(p, &w, &expected);
    all_traps(1);
    before = now();
    call_into(p, &w, &o);
    check(as_before(&before), "state in memory of the caller");
    w.lwork--;
    check(call(p, &w, o.out, o.line_info, o.rcond) < 0 && as_before(&before), "state where a length is refused");
    all_traps(0);
    check(same(&o, &expected), "in memory of the caller: the bits without traps");
    free(w.work);
    free(w.iwork);
    free_outcome(&expected);
    free_outcome(&o);
}

/* Refused arguments, NaN among them. */
static void compare_refused(const problem *good)
{
    problem p = *good;
    double *const offset = p.in[1], first = offset == NULL ? 0.0 : offset[0];
    int kind;

    for (kind = 0; make_wrong(&p, kind); kind++, p = *good)
        compare(&p);
    if (p.routine == CENTRAL_DIFFERENCE || p.routine == DIFFERENCE_WEIGHTS) {
        static const double strange[] = {NAN, INFINITY, 1e308, 5e-324};

        for (kind = 0; kind < 4; kind++) {
            offset[0] = strange[kind];
            compare(&p);
        }
        offset[0] = first;
    }
}

static void name(const problem *p, jf_int engine, const char *kind)
{
    snprintf(what, sizeof what, "%s %c n=%d engine=%d %s", routine_name[p->routine], p->trans, (int)p->size[0],
             (int)engine, kind);
}

static void one_problem(int routine, char trans, int n, int variant, jf_int engine)
{
    static const char kinds[] = "0nshlmt";
    problem p = new_problem(routine, trans, n, LINES, variant);
    int k;

    name(&p, engine, "good");
    compare(&p);
    if (n == 2)
        compare_refused(&p);
    spoil_some(&p);
    name(&p, engine, "some spoiled");
    compare(&p);
    if (engine == JF_ENGINE_LAPACK && routine < WORK_ROUTINES)
        compare_in_memory(&p);
    free_problem(&p);
    for (k = 0; kinds[k] != '\0' && n <= 4 && (variant == 0 || routine < WORK_ROUTINES); k++) {
        p = new_problem(routine, trans, n, LINES, variant);
        spoil_all(&p, kinds[k]);
        name(&p, engine, "all spoiled");
        compare(&p);
        free_problem(&p);
    }
}

/* Orders that say nothing new: bricks have none, and no engine either; noise goes entry by entry. The manifold has one
   code for all. */
static int too_many(int routine, int n, jf_int engine)
{
    switch (routine) {
    case BRICK_MATRICES: case BRICK_QUALITY: return n > 2 || engine != JF_ENGINE_LAPACK;
    case PROJECT_ON_JOINT: case JOINT_FORMS: case EXPECT_ON_JOINT: case FIT_JOINT: return n > 3;
    case POLLUTE: case MONTE_CARLO: return n > 2;
    case COMPLIANCE_COVARIANCE: return n > 5;
    case DECOUPLE: return n > 8;
    default: return 0;
    }
}

static void every_routine(jf_int engine)
{
    static const int orders[] = {1, 2, 3, 4, 5, 6, 7, 8, 12};
    int routine, i, t, variant;

    for (routine = 0; routine < ROUTINES; routine++)
        for (i = 0; i < 9; i++)
            for (variant = 0; variant < variants(routine); variant++)
                for (t = 0; t < 2; t++)
                    if (!too_many(routine, orders[i], engine) && (orders[i] < 5 || (i + variant + engine) % 2 == t))
                        one_problem(routine, "NT"[t], orders[i], variant, engine);
}

/* What the host may have set besides: rounding, flags raised before, flush to zero. */
static void other_states(jf_int engine)
{
    static const int directed[] = {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    static const int raised[] = {0, FE_DIVBYZERO, FE_INVALID | FE_INEXACT, FE_OVERFLOW | FE_UNDERFLOW | FE_INEXACT};
    int routine, k;

    for (routine = 0; routine < ROUTINES; routine++) {
        problem p = new_problem(routine, 'N', 4, LINES, 0);
        outcome o = new_outcome(&p);
        state before;

        spoil_some(&p);
        name(&p, engine, "flags");
        for (k = 0; k < 4; k++) {
            feclearexcept(FE_ALL_EXCEPT);
            feraiseexcept(raised[k]);
            before = now();
            call_into(&p, NULL, &o);
            check(as_before(&before) && before.flags == raised[k], "flags are those before the call");
        }
        feclearexcept(FE_ALL_EXCEPT);
        name(&p, engine, "rounding");
        for (k = 0; k < 3; k++) {
            fesetround(directed[k]);
            compare(&p);
            fesetround(FE_TONEAREST);
        }
#if defined(__x86_64__)
        name(&p, engine, "flush to zero");
        _mm_setcsr(_mm_getcsr() | 0x8040);
        before = now();
        call_into(&p, NULL, &o);
        check(as_before(&before) && (_mm_getcsr() & 0x8040) == 0x8040, "denormals are treated as before");
        _mm_setcsr(_mm_getcsr() & ~0x8040u);
#endif
        free_outcome(&o);
        free_problem(&p);
    }
}

/* The threads that OpenMP keeps have traps of their own. */
static void workers(jf_int engine)
{
    int routine, variant;

    for (routine = 0; routine < ROUTINES; routine++)
        for (variant = 0; variant < variants(routine); variant += 3) {
            const int large = routine == COMPLIANCE_COVARIANCE || routine == MONTE_CARLO || routine == PROJECT_ON_JOINT
                              || routine == JOINT_FORMS || routine == EXPECT_ON_JOINT || routine == FIT_JOINT;
            const int n = large ? 3 : 9;
            problem p = new_problem(routine, 'N', n, MANY_LINES, variant);
            outcome expected = new_outcome(&p), o = new_outcome(&p);
            int line, kept = 1;

            for (line = 0; line < MANY_LINES; line++)
                if (line % 3 == 1)
                    spoil(&p, line, "n0shitlm"[line / 3 % 8]);
            name(&p, engine, "workers");
            call_into(&p, NULL, &expected);
#pragma omp parallel
            all_traps(1);
            call_into(&p, NULL, &o);
#pragma omp parallel reduction(&& : kept)
            {
                const state s = now();

                kept = s.traps == ALL && s.flags == 0 && s.rounding == FE_TONEAREST;
                all_traps(0);
            }
            check(kept, "state of the threads");
            check(same(&o, &expected), "two threads: the bits without traps");
            free_outcome(&expected);
            free_outcome(&o);
            free_problem(&p);
        }
}

int main(void)
{
    struct sigaction action = {.sa_handler = stopped};
    jf_int engine, info;
    int threads = 1;

    if (feenableexcept(ALL) < 0 || fegetexcept() != ALL)
        return 77;      /* this processor does not trap */
    fedisableexcept(ALL);
    sigaction(SIGFPE, &action, NULL);
#ifdef _OPENMP
    threads = omp_get_max_threads();
#endif
    for (engine = JF_ENGINE_LAPACK; engine <= JF_ENGINE_X86_64_V4; engine++) {
        jf_set_engine(&engine, &info);
        if (info != 0)
            continue;
        if (threads > 1) {
            workers(engine);
        } else {
            every_routine(engine);
            other_states(engine);
        }
    }
    printf("traps: %d checks, %d failed\n", checks, failures);
    return failures != 0;
}
