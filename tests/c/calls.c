#include "calls.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GUARD 64        /* bytes before and after each array of an outcome */
#define PATTERN 0x5a

const char *const routine_name[ROUTINES] = {
    "invert", "solve", "receptance", "receptance_banded", "receptance_modal", "couple", "modify", "find_modification",
    "ismm", "inverse_substructuring", "decouple", "joint_compliance", "compliance_factors", "compliance_covariance",
    "transform", "central_difference", "project_on_joint", "joint_forms", "pollute", "monte_carlo", "brick_matrices",
    "brick_quality", "difference_weights", "expect_on_joint", "fit_diagonal_joint",
    "joint_normal_equations", "rational_fit", "relocate_poles",
};
/* The number of LWORK among the arguments; that of LIWORK is two more. */
const int lwork_argument[WORK_ROUTINES] = {8, 11, 20, 22, 16, 15, 12, 10, 11, 9, 18, 9, 11, 13, 14};

int checks, failures;
char what[100];

void check(int condition, const char *claim)
{
    checks++;
    if (condition)
        return;
    failures++;
    fprintf(stderr, "FAILED: %s: %s\n", what, claim);
}

outcome new_outcome(const problem *p)
{
    const size_t lines = p->n_freq > 0 ? (size_t)p->n_freq : 0, numbers = p->out_line * lines + 2 * MOST_DOFS;
    outcome o;

    o.n_bytes = (numbers + lines) * sizeof(double) + 2 * lines * sizeof(jf_int) + 4 * GUARD;
    o.bytes = malloc(o.n_bytes);
    o.out = (double *)(o.bytes + GUARD);
    o.rcond = o.out + numbers + GUARD / sizeof(double);
    o.line_info = (jf_int *)(o.rcond + lines + GUARD / sizeof(double));
    clear(&o);
    return o;
}

void free_outcome(outcome *o)
{
    free(o->bytes);
}

void clear(outcome *o)
{
    memset(o->bytes, PATTERN, o->n_bytes);
    o->info = 12345;
}

static int is_pattern(const void *bytes, size_t n)
{
    const unsigned char *b = bytes;

    while (n-- > 0)
        if (*b++ != PATTERN)
            return 0;
    return 1;
}

int guards_stay(const outcome *o)
{
    return is_pattern(o->bytes, GUARD) && is_pattern(o->rcond - GUARD / sizeof(double), GUARD)
           && is_pattern(o->line_info - GUARD / sizeof(jf_int), GUARD)
           && is_pattern(o->bytes + o->n_bytes - GUARD, GUARD);
}

int untouched(const outcome *o)
{
    return is_pattern(o->bytes, o->n_bytes);
}

int same(const outcome *a, const outcome *b)
{
    return a->info == b->info && a->n_bytes == b->n_bytes && memcmp(a->bytes, b->bytes, a->n_bytes) == 0;
}

#define CALL(name, ...)                                                                                              \
    do {                                                                                                             \
        if (w != NULL)                                                                                               \
            jf_##name##_work(__VA_ARGS__, line_info, rcond, w->work, &w->lwork, w->iwork, &w->liwork, &info);        \
        else                                                                                                         \
            jf_##name(__VA_ARGS__, line_info, rcond, &info);                                                         \
    } while (0)

void begin(const problem *p, double *out)
{
    const size_t lines = p->n_freq > 0 ? (size_t)p->n_freq : 0, numbers = 2 * (size_t)(p->size[0] * p->size[0]) * lines;

    switch (p->routine) {
    case PROJECT_ON_JOINT: case EXPECT_ON_JOINT:
        memcpy(out, p->in[4], numbers * sizeof *out);
        memcpy(out + numbers, p->in[5], numbers * sizeof *out);
        break;
    case FIT_DIAGONAL_JOINT: memcpy(out, p->in[3] + 2 * (p->in_all[3] / 3), p->in_all[3] / 3 * sizeof *out); break;
    case RELOCATE_POLES: memcpy(out, p->in[3], p->in_all[3] * sizeof *out);
    }
}

jf_int call(const problem *p, const workspace *w, double *out, jf_int *line_info, double *rcond)
{
    static const jf_int seed[2] = {17, 4}, none = 0, one = 1, first = 5, count = REALISATIONS;
    const char *t = &p->trans, *letters = p->letters;
    const jf_int *s = p->size, *n_freq = &p->n_freq;
    const size_t lines = p->n_freq > 0 ? (size_t)p->n_freq : 0, square = (size_t)(s[0] * s[0]);
    const jf_complex *a = (const jf_complex *)p->in[0], *b = (const jf_complex *)p->in[1];
    const jf_complex *c = (const jf_complex *)p->in[2];
    double *const *in = p->in;
    jf_complex *h = (jf_complex *)out;
    const size_t part = p->in_all[3] / 3;
    jf_int info = 12345;

    begin(p, out);
    switch (p->routine) {
    case INVERT: CALL(invert, s, n_freq, a, h); break;
    case SOLVE: CALL(solve, t, s, s + 1, n_freq, a, b, h); break;
    case RECEPTANCE:
        CALL(receptance, t, s, n_freq, s + 1, s + 2, in[0], in[1], in[2], s + 3, in[3], s + 4, in[4], &p->number,
             p->dofs[1], p->dofs[0], h);
        break;
    case RECEPTANCE_BANDED:
        CALL(receptance_banded, t, s, s + 5, s + 6, n_freq, s + 1, s + 2, in[0], in[1], in[2], s + 3, in[3], s + 4,
             in[4], &p->number, p->dofs[1], p->dofs[0], h);
        break;
    case RECEPTANCE_MODAL:
        CALL(receptance_modal, t, s, n_freq, s + 1, s + 2, in[0], in[1], in[2], in[3], in[4], in[5], h);
        break;
    case COUPLE: CALL(couple, t, s, s + 1, s + 2, n_freq, a, b, c, p->dofs[0], p->dofs[1], h); break;
    case MODIFY: CALL(modify, t, s, s + 1, n_freq, a, b, p->dofs[1], h); break;
    case FIND_MODIFICATION: CALL(find_modification, t, s, n_freq, a, b, h); break;
    case ISMM: CALL(ismm, t, s, n_freq, a, b, c, h); break;
    case INVERSE_SUBSTRUCTURING: CALL(inverse_substructuring, t, s, n_freq, a, h); break;
    case DECOUPLE:
        CALL(decouple, letters, t, s, s + 1, s + 2, n_freq, a, b, c, p->dofs[0], p->dofs[1], p->dofs[2], p->dofs[3], h);
        break;
    case JOINT_COMPLIANCE: CALL(joint_compliance, t, s, n_freq, a, h); break;
    case COMPLIANCE_FACTORS: CALL(compliance_factors, t, s, s + 1, n_freq, a, in[1], h); break;
    case COMPLIANCE_COVARIANCE: CALL(compliance_covariance, t, &p->flag, s, s + 1, n_freq, a, in[1], in[2], h); break;
    case TRANSFORM: CALL(transform, t, s, s + 1, s + 2, s + 3, n_freq, a, in[1], in[2], h); break;
    case CENTRAL_DIFFERENCE: jf_central_difference(t, s + 1, n_freq, in[1], a, h, line_info, rcond, &info); break;
    case DIFFERENCE_WEIGHTS: jf_difference_weights(s + 1, in[1], out, &info); break;
    case PROJECT_ON_JOINT:
        jf_project_on_joint(t, &p->flag, s, s + 2, n_freq, s + 3, &p->number, a, in[1], in[2], (jf_complex *)in[3], h,
                            h + square * lines, rcond, line_info, &info);
        break;
    case JOINT_FORMS:
        jf_joint_forms(t, &p->flag, s, s + 4, s + 2, n_freq, &one, a, in[1], in[2], (jf_complex *)in[3],
                       (jf_complex *)in[4], (jf_complex *)in[5], h, h + (size_t)(s[4] * s[4]) * lines, rcond,
                       line_info, &info);
        break;
    case POLLUTE:
        jf_pollute(t, letters, letters + 1, &p->flag, &one, &p->number, seed, s, s, n_freq, &first, &count, a, h,
                   &info);
        break;
    case MONTE_CARLO:
        jf_monte_carlo(t, letters, "C", "E", &p->flag, &one, &p->number, seed, s, n_freq, &first, &count, a, b, c,
                       line_info + lines, h, out + 2 * square * lines, line_info, rcond, &info);
        break;
    case BRICK_MATRICES:
        jf_brick_matrices(letters, n_freq, in[0], in[1], in[2], in[3], &p->number, &p->flag, out, out + 576 * lines,
                          line_info, &info);
        break;
    case BRICK_QUALITY: jf_brick_quality(n_freq, in[0], out, out + lines, &info); break;
    case EXPECT_ON_JOINT:
        jf_expect_on_joint(t, &p->flag, s, s + 2, n_freq, &p->number, in[3], in[1], in[2], a, h, h + square * lines,
                           line_info, &info);
        break;
    case FIT_DIAGONAL_JOINT:
        jf_fit_diagonal_joint(t, &p->flag, s, s + 1, n_freq, s + 3, &none, &p->number, p->dofs[0], p->dofs[1], in[3],
                              in[3] + part, in[0], b, c, (jf_complex *)in[4], in[5], out, out + part,
                              out + part + part * part, out + 2 * part + part * part, &info);
        break;
    case JOINT_NORMAL_EQUATIONS:
        jf_joint_normal_equations(t, s, s + 1, s + 2, n_freq, p->dofs[0], p->dofs[1], a, b, c, (jf_complex *)in[3], out,
                                  out + (size_t)s[1] * (size_t)s[1], &info);
        break;
    case RATIONAL_FIT:
        jf_rational_fit(s, s + 1, n_freq, a, b, in[2], (jf_complex *)in[3], h, out + p->out_line * lines,
                        out + p->out_line * lines + 1, &info);
        break;
    case RELOCATE_POLES:
        jf_relocate_poles(s, s + 1, n_freq, s + 3, &p->number, a, b, in[2], h, out + p->in_all[3], &info);
    }
    return info;
}

void call_into(const problem *p, const workspace *w, outcome *o)
{
    o->info = call(p, w, o->out, o->line_info, o->rcond);
}

jf_int call_line(const problem *p, int line, const workspace *w, outcome *o)
{
    problem one = *p;
    int k;

    one.n_freq = 1;
    for (k = 0; k < MOST_INPUTS; k++)
        if (one.in[k] != NULL)
            one.in[k] += p->in_line[k] * (size_t)line;
    return call(&one, w, o->out + p->out_line * (size_t)line, o->line_info + line, o->rcond + line);
}
