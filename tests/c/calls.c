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
    "joint_normal_equations", "rational_fit", "relocate_poles", "smooth_frfs",
    "estimate_noise", "line_correlation", "line_levels", "noise_parts",
    "lowest_diagonal_joint", "start_joint", "fit_joint",
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
    case FIT_DIAGONAL_JOINT: case LOWEST_DIAGONAL_JOINT:
        memcpy(out, p->in[3] + 2 * (p->in_all[3] / 3), p->in_all[3] / 3 * sizeof *out);
        break;
    case RELOCATE_POLES: memcpy(out, p->in[3], p->in_all[3] * sizeof *out); break;
    case LINE_CORRELATION: memcpy(out, p->in[0], p->in_all[0] * sizeof *out);
    }
}

/* The joint without cross terms of FRFs at the joint; results one after the other. */
static jf_int fit_joint(const problem *p, double *out, jf_int *line_info)
{
    static const jf_int from_nothing = 0, patience = 4, rigid = 0;
    const jf_int *s = p->size;
    const size_t lines = p->n_freq > 0 ? (size_t)p->n_freq : 0, n = (size_t)(s[0] > 0 ? s[0] : 0);
    const size_t n_par = (size_t)(s[1] > 0 ? s[1] : 0), square = n_par * n_par;
    jf_complex *h = (jf_complex *)out, *q = h + n * n * lines, *c = q + n * n * lines, *w = c + n * lines;
    jf_complex *g = w + n * n * lines;
    double *descents = (double *)(g + n * lines), *distance = descents + n_par * lines, *squares = distance + lines;
    double *spring = squares + lines, *x = spring + n, *values = x + n_par, *descent = values + n_par;
    double *covariance = descent + n_par, *normal = covariance + square, *numbers = normal + square;
    jf_int iterations, converged, info = 12345;

    jf_fit_joint(&p->trans, &p->flag, s, s + 1, s + 3, s + 4, s + 2, &p->n_freq, &from_nothing, &patience, &rigid,
                 &p->number, p->dofs[0], p->dofs[1], p->in[4], (const jf_complex *)p->in[0],
                 (const jf_complex *)p->in[3], p->in[1], p->in[2], spring, x, h, q, values, covariance, normal, descent,
                 numbers, numbers + 1, descents, distance, line_info + lines, c, w, g, squares, &iterations, &converged,
                 line_info, &info);
    return info;
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
    const double found = 0.0, unit = 1.0;
    double found_squares, *const rest = out + p->out_line * lines;
    jf_int info = 12345, n_found;

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
        break;
    case SMOOTH_FRFS:
        jf_smooth_frfs(s + 1, n_freq, s, s + 2, s + 3, &found, in[0], b, in[2], (jf_complex *)(out + p->out_line * lines),
                       &n_found, h, &found_squares, &info);
        if (info >= 0)
            out[p->out_line * lines + 2 * (size_t)s[0]] = n_found + found_squares;
        break;
    case ESTIMATE_NOISE:
        jf_estimate_noise(s, n_freq, &one, &p->flag, in[0], b, c, in[3], in[4], &one, s, &unit, rest, out,
                          out + (size_t)s[0] * lines, out + (size_t)(s[0] + 1) * lines, &n_found, &found_squares, &info);
        if (info >= 0)
            rest[3 * s[0]] = n_found + found_squares;
        break;
    case LINE_CORRELATION:
        jf_line_correlation(s, n_freq, h, &p->number, &found_squares, &info);
        if (info >= 0)
            rest[0] = found_squares;
        break;
    case LINE_LEVELS: jf_line_levels(s, n_freq, a, &unit, &p->flag, out, out + lines, &info); break;
    case NOISE_PARTS: jf_noise_parts("L", s + 1, s, n_freq, in[0], in[1], rest, &info);
        break;
    case LOWEST_DIAGONAL_JOINT:
        jf_lowest_diagonal_joint(t, &p->flag, s, s + 1, n_freq, s + 3, &none, &p->number, p->dofs[0], p->dofs[1], in[3],
                                 in[3] + part, in[0], b, c, (jf_complex *)in[4], in[5], out, out + part,
                                 out + part + part * part, out + 2 * part + part * part, &info);
        break;
    case START_JOINT:
        jf_start_joint(t, &p->flag, s, s + 1, s + 3, s + 4, n_freq, p->dofs[0], p->dofs[1], in[4], in[5], a, in[1], out,
                       out + (s[1] > 0 ? s[1] : 0), &info);
        break;
    case FIT_JOINT: info = fit_joint(p, out, line_info);
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
