/* jf_NAME_work gives the bits of jf_NAME with LAPACK, all lines at once or one by one, in memory of exactly the length
   that a query answers; what is refused or asked for writes nothing else. */
#include <complex.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calls.h"

#define LINES 12
#define GUARDS 16       /* bytes before and after the workspace: complex numbers stay aligned */

static void choose(jf_int engine)
{
    jf_int info;

    jf_set_engine(&engine, &info);
    check(info == 0, "engine chosen");
}

/* Memory of these lengths between guards. */
typedef struct {
    workspace space;
    unsigned char *bytes[2], *before[2];
    size_t length[2];
} guarded;

static guarded new_memory(jf_int lwork, jf_int liwork, size_t numbers, size_t integers)
{
    guarded g;
    int k;

    g.length[0] = numbers * sizeof(jf_complex) + 2 * GUARDS;
    g.length[1] = integers * sizeof(jf_int) + 2 * GUARDS;
    for (k = 0; k < 2; k++) {
        g.bytes[k] = malloc(g.length[k]);
        g.before[k] = malloc(g.length[k]);
        memset(g.bytes[k], 0x6b, g.length[k]);
        memcpy(g.before[k], g.bytes[k], g.length[k]);
    }
    g.space.work = (jf_complex *)(g.bytes[0] + GUARDS);
    g.space.iwork = (jf_int *)(g.bytes[1] + GUARDS);
    g.space.lwork = lwork;
    g.space.liwork = liwork;
    return g;
}

static void free_memory(guarded *g)
{
    int k;

    for (k = 0; k < 2; k++) {
        free(g->bytes[k]);
        free(g->before[k]);
    }
}

/* Whether at most so many numbers and integers were written, and nothing outside. */
static int written(const guarded *g, size_t numbers, size_t integers)
{
    const size_t used[2] = {GUARDS + numbers * sizeof(jf_complex), GUARDS + integers * sizeof(jf_int)};
    int k, well = 1;

    for (k = 0; k < 2; k++)
        well = well && memcmp(g->bytes[k], g->before[k], GUARDS) == 0
               && memcmp(g->bytes[k] + used[k], g->before[k] + used[k], g->length[k] - used[k]) == 0;
    return well;
}

/* The least lengths, by each way to ask. */
static void query(const problem *p, outcome *o, jf_int *lwork, jf_int *liwork)
{
    static const jf_int asked[3][2] = {{-1, -1}, {-1, 1}, {1, -1}};
    jf_int first[2] = {0, 0};
    int k;

    for (k = 0; k < 3; k++) {
        guarded g = new_memory(asked[k][0], asked[k][1], 2, 2);

        clear(o);
        call_into(p, &g.space, o);
        check(o->info == 0 && untouched(o), "a query does nothing");
        check(written(&g, 1, 1), "a query writes two numbers");
        *lwork = (jf_int)creal(g.space.work[0]);
        *liwork = g.space.iwork[0];
        check(*lwork >= 1 && *liwork >= 1 && g.space.work[0] == (double)*lwork, "least lengths");
        if (k == 0) {
            first[0] = *lwork;
            first[1] = *liwork;
        }
        check(*lwork == first[0] && *liwork == first[1], "the same however asked");
        free_memory(&g);
    }
}

/* Lengths that do not suffice: refused in the order of the arguments, and nothing is written. */
static void too_small(const problem *p, outcome *o, jf_int lwork, jf_int liwork)
{
    const int number = lwork_argument[p->routine];
    const jf_int lengths[6][2] = {{lwork - 1, liwork}, {lwork, liwork - 1}, {lwork - 1, liwork - 1}, {-2, liwork},
                                  {lwork, -2}, {0, 0}};
    const int argument[6] = {number, number + 2, number, number, number + 2, number};
    int k;

    for (k = 0; k < 6; k++) {
        guarded g = new_memory(lengths[k][0], lengths[k][1], (size_t)lwork, (size_t)liwork);

        clear(o);
        call_into(p, &g.space, o);
        check(o->info == -argument[k], "too small a length is refused by its number");
        check(untouched(o) && written(&g, 0, 0), "refused for a length: nothing written");
        free_memory(&g);
    }
}

/* In memory of exactly these lengths: all lines at once with every engine chosen, and one by one. What the lines took is
   left in the first numbers: these lengths, where every line is computed. */
static void compare(const problem *p, const outcome *expected, outcome *o, jf_int lwork, jf_int liwork, int computed)
{
    guarded g = new_memory(lwork, liwork, (size_t)lwork, (size_t)liwork);
    jf_int engine, info, bad = 0, line_info;
    int line;

    for (engine = JF_ENGINE_X86_64_V4; engine >= JF_ENGINE_AUTOMATIC; engine--) {
        jf_set_engine(&engine, &info);
        if (info != 0)
            continue;
        clear(o);
        call_into(p, &g.space, o);
        check(same(o, expected), "all lines at once: the bits of LAPACK");
        if (computed)
            check(g.space.work[0] == (double)lwork && g.space.iwork[0] == liwork, "the lines take what was declared");
    }
    clear(o);
    for (line = 0; line < p->n_freq; line++) {
        line_info = call_line(p, line, &g.space, o);
        check(line_info == (expected->line_info[line] != 0), "info of one line");
        bad += line_info;
    }
    o->info = bad;
    check(same(o, expected) && guards_stay(o), "line by line: the same bits");
    check(written(&g, (size_t)lwork, (size_t)liwork), "memory beside the workspace");
    free_memory(&g);
}

/* Wrong arguments are refused alike, whatever the lengths, a query as well. */
static void wrong_arguments(const problem *good, outcome *a, outcome *b, jf_int lwork, jf_int liwork)
{
    problem p = *good;
    int kind, k, refused = 0;

    for (kind = 0; make_wrong(&p, kind); kind++, p = *good) {
        clear(a);
        call_into(&p, NULL, a);
        if (a->info >= 0)
            continue;
        refused++;
        for (k = 0; k < 3; k++) {
            guarded g = new_memory(k == 1 ? -1 : k == 2 ? 0 : lwork, liwork, (size_t)lwork, (size_t)liwork);

            clear(b);
            call_into(&p, &g.space, b);
            check(b->info == a->info, "wrong arguments have the same number");
            check(untouched(b) && written(&g, 0, 0), "wrong arguments: nothing written");
            free_memory(&g);
        }
    }
    check(refused >= (good->routine == INVERT ? 2 : 3), "some arguments were wrong");
}

/* Codes seen in lines of each routine: singular, not finite, overflow. */
static int seen[WORK_ROUTINES][3];

static void one_problem(int routine, char trans, int n, int variant, const char *bad_lines)
{
    problem p = new_problem(routine, trans, n, LINES, variant);
    outcome expected = new_outcome(&p), o = new_outcome(&p);
    jf_int lwork, liwork, lwork_of_none, liwork_of_none;
    int line, good = 1;

    snprintf(what, sizeof what, "%s %c n=%d variant=%d lines '%s'", routine_name[routine], trans, n, variant,
             bad_lines);
    for (line = 0; bad_lines[line] != '\0'; line++)
        if (bad_lines[line] != ' ' && n > 0)
            spoil(&p, line, bad_lines[line]);
    choose(JF_ENGINE_LAPACK);
    call_into(&p, NULL, &expected);
    for (line = 0; line < LINES; line++) {
        const jf_int code = expected.line_info[line];

        good = good && (code == 0 || (line < (int)strlen(bad_lines) && bad_lines[line] != ' '));
        if (code != 0)
            seen[routine][code > 0 ? 0 : code == JF_LINE_NOT_FINITE ? 1 : 2]++;
    }
    check(good && expected.info >= 0 && guards_stay(&expected), "the lines that are not spoiled are good");
    query(&p, &o, &lwork, &liwork);
    compare(&p, &expected, &o, lwork, liwork, n > 0);
    too_small(&p, &o, lwork, liwork);
    if (n == 3)
        wrong_arguments(&p, &expected, &o, lwork, liwork);
    p.n_freq = 0;
    query(&p, &o, &lwork_of_none, &liwork_of_none);
    check(lwork == lwork_of_none && liwork == liwork_of_none, "lengths do not depend on the number of lines");
    free_outcome(&expected);
    free_outcome(&o);
    p.n_freq = LINES;
    free_problem(&p);
}

int main(void)
{
    static const int orders[] = {0, 1, 2, 3, 6, 33, 40, 120};
    int routine, i, t, variant;

    for (routine = 0; routine < WORK_ROUTINES; routine++) {
        for (i = 0; i < 8; i++) {
            if (orders[i] > 6 && routine != INVERT && routine != RECEPTANCE && routine != COUPLE)
                continue;
            if (orders[i] > 40 && routine != INVERT)        /* an OpenBLAS would take threads */
                continue;
            for (t = 0; t < 2; t++)
                for (variant = 0; variant < variants(routine); variant++) {
                    one_problem(routine, "NT"[t], orders[i], variant, "");
                    one_problem(routine, "nt"[t], orders[i], variant, "on 0sh i tlm");
                }
        }
        snprintf(what, sizeof what, "%s", routine_name[routine]);
        check(seen[routine][1] > 0 && seen[routine][2] > 0, "lines with NaN and lines that overflow were there");
        check(seen[routine][0] > 0 || routine == TRANSFORM, "singular lines were there");
    }
    printf("api_work: %d checks, %d failed\n", checks, failures);
    return failures != 0;
}
