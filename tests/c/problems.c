#include "calls.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Kinds of noise, by their letters. */
static const char noises[] = "CPNUS";

int variants(int routine)
{
    switch (routine) {
    case RECEPTANCE: case RECEPTANCE_BANDED: case DECOUPLE: case PROJECT_ON_JOINT: case JOINT_FORMS:
    case EXPECT_ON_JOINT: case FIT_JOINT: return 4;
    case COMPLIANCE_COVARIANCE: case FIT_DIAGONAL_JOINT: case ESTIMATE_NOISE: case LINE_LEVELS: return 2;
    case LOWEST_DIAGONAL_JOINT: case START_JOINT: return 2;
    case POLLUTE: return sizeof noises - 1;
    case MONTE_CARLO: case BRICK_MATRICES: return 3;
    default: return 1;
    }
}

/* Between -1 and 1. */
static double uniform(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return (double)(*state >> 11) / 4503599627370496.0 - 1.0;
}

static double *numbers(problem *p, int k, size_t in_line, size_t shared, uint64_t *state)
{
    const size_t count = in_line * (size_t)p->n_freq + shared;
    size_t i;

    p->in_line[k] = in_line;
    p->in_all[k] = count;
    p->in[k] = malloc((count + 1) * sizeof(double));
    for (i = 0; i < count; i++)
        p->in[k][i] = uniform(state);
    return p->in[k];
}

/* Lines of complex matrices. */
static void lines(problem *p, int k, int rows, int columns, uint64_t *state)
{
    numbers(p, k, 2 * (size_t)rows * (size_t)columns, 0, state);
}

/* Square ones that are regular, and so are their blocks jk and kj when they have two of each. */
static void regular(problem *p, int k, int n, uint64_t *state)
{
    const double large = 4.0 * sqrt(n) + 2.0;
    int l, i;

    lines(p, k, n, n, state);
    for (l = 0; l < p->n_freq; l++)
        for (i = 0; i < n; i++) {
            double *a = p->in[k] + 2 * ((size_t)n * (size_t)n * (size_t)l);

            a[2 * (i * n + i)] += large;
            a[2 * (i * n + (i + n / 2) % n) + 1] += large / 2;
        }
}

/* K, M, C and H of a model whose first DOF has mass but no stiffness: singular where omega = 0. */
static void model(problem *p, int n, int kl, int ku, int banded, uint64_t *state)
{
    const int rows = banded ? kl + ku + 1 : n;
    int k, i, j;

    for (k = 1; k <= 4; k++) {
        double *a = numbers(p, k, 0, (size_t)rows * (size_t)n, state);

        for (j = 0; j < n; j++)
            for (i = 0; i < n; i++) {
                double *entry = a + j * rows + (banded ? ku + i - j : i);

                if (banded && (i - j > kl || j - i > ku))
                    continue;
                *entry = (i == j && k < 3 ? 2.0 + n : 0.0) + 0.2 * *entry;
                if ((k == 1 || k == 4) && (i == 0 || j == 0))
                    *entry = 0.0;
            }
    }
}

static void frequencies(problem *p, uint64_t *state)
{
    int i;

    numbers(p, 0, 1, 0, state);
    for (i = 0; i < p->n_freq; i++)
        p->in[0][i] = 2.0 + p->in[0][i];
}

static void elements(problem *p, uint64_t *state)
{
    static const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, 
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    int k, l, i;

    numbers(p, 0, 24, 0, state);
    for (l = 0; l < p->n_freq; l++)
        for (i = 0; i < 24; i++)
            p->in[0][24 * l + i] = corner[i / 3][i % 3] + 0.1 * p->in[0][24 * l + i];
    for (k = 1; k <= 3; k++)
        numbers(p, k, 1, 0, state);
    for (l = 0; l < p->n_freq; l++) {
        p->in[1][l] = 2.0 + p->in[1][l];
        p->in[2][l] = 0.4 * p->in[2][l];
        p->in[3][l] = 2.0 + p->in[3][l];
    }
}

problem new_problem(int routine, char trans, int n, int n_freq, int variant)
{
    problem p = {.routine = routine, .trans = trans, .letters = "rr", .n_freq = n_freq, .number = 0.1};
    uint64_t state = 88172645463325252ULL + 1000003ULL * (uint64_t)(routine + 40 * n + 4000 * n_freq + 7 * variant);
    const int m = n + 1, joint = 2 * n;
    int i, k;

    for (i = 0; i < MOST_DOFS; i++) {
        p.dofs[0][i] = i + 1;
        p.dofs[1][i] = i < n ? n - i : i + 1;
        p.dofs[2][i] = n + i + 1;
        p.dofs[3][i] = n + i + 1;
    }
    p.size[0] = n;
    p.size[1] = m;
    p.flag = variant % 2;
    switch (routine) {
    case INVERT: case FIND_MODIFICATION: case SOLVE:
        regular(&p, 0, n, &state);
        if (routine == FIND_MODIFICATION)
            regular(&p, 1, n, &state);
        if (routine == SOLVE)
            lines(&p, 1, n, 3, &state);
        p.size[1] = 3;
        p.out_line = 2 * (size_t)n * (size_t)(routine == SOLVE ? 3 : n);
        break;
    case RECEPTANCE: case RECEPTANCE_BANDED:
        p.size[1] = n;
        p.size[2] = n < 2 ? n : 2;
        p.size[3] = variant & 1 ? n : 0;
        p.size[4] = variant & 2 ? n : 0;
        p.size[5] = n < 2 ? 0 : 1;
        p.size[6] = n < 3 ? 0 : 2;
        frequencies(&p, &state);
        model(&p, n, (int)p.size[5], (int)p.size[6], routine == RECEPTANCE_BANDED, &state);
        p.out_line = 2 * (size_t)n * (size_t)p.size[2];
        break;
    case RECEPTANCE_MODAL:
        p.size[2] = 2;
        frequencies(&p, &state);
        for (i = 1; i <= 3; i++)
            numbers(&p, i, 0, (size_t)n, &state);
        for (i = 0; i < n; i++) {
            p.in[1][i] = i == 0 ? 0.0 : 2.0 + p.in[1][i];
            p.in[2][i] = i == 0 ? 0.0 : 2.0 + p.in[2][i];
        }
        numbers(&p, 4, 0, (size_t)n * (size_t)m, &state);
        numbers(&p, 5, 0, (size_t)n * 2, &state);
        p.out_line = 2 * (size_t)m * 2;
        break;
    case COUPLE:
        p.size[0] = m;
        p.size[1] = n;
        p.size[2] = n;
        regular(&p, 0, m, &state);
        regular(&p, 1, n, &state);
        regular(&p, 2, n, &state);
        p.out_line = 2 * (size_t)(n + m) * (size_t)(n + m);
        break;
    case MODIFY:
        p.size[1] = m / 2;
        regular(&p, 0, n, &state);
        regular(&p, 1, m / 2, &state);
        p.out_line = 2 * (size_t)n * (size_t)n;
        break;
    case DECOUPLE:
        p.letters[0] = "rrss"[variant];
        p.letters[1] = "rsrs"[variant];
        p.size[0] = joint;
        p.size[1] = joint;
        p.size[2] = n;
        regular(&p, 0, joint, &state);
        regular(&p, 1, joint, &state);
        regular(&p, 2, n, &state);
        p.out_line = 2 * (size_t)n * (size_t)n;
        break;
    case ISMM: case MONTE_CARLO: case INVERSE_SUBSTRUCTURING: case JOINT_COMPLIANCE:
        p.letters[0] = "ISC"[variant];
        regular(&p, 0, joint, &state);
        regular(&p, 1, joint, &state);
        lines(&p, 2, n, n, &state);
        p.out_line = (routine == MONTE_CARLO ? 5 : 2) * (size_t)n * (size_t)n;
        break;
    case COMPLIANCE_FACTORS: case COMPLIANCE_COVARIANCE:
        regular(&p, 0, joint, &state);
        numbers(&p, 1, 0, (size_t)joint * (size_t)m, &state);
        numbers(&p, 2, (size_t)m * (size_t)m, 0, &state);
        for (i = 0; i < (int)p.in_all[2]; i++)
            p.in[2][i] = 2.0 + p.in[2][i];
        p.out_line = routine == COMPLIANCE_FACTORS ? 4 * (size_t)n * (size_t)m : 2 * (size_t)(n * n) * (size_t)(n * n);
        break;
    case TRANSFORM:
        p.size[0] = 3;
        p.size[1] = n;
        p.size[2] = m;
        p.size[3] = m;
        lines(&p, 0, m, m, &state);
        for (i = 1; i <= 2; i++)
            numbers(&p, i, 0, (size_t)m * 3 + (size_t)m * (size_t)n, &state);
        for (i = 0; i < (int)p.in_all[1]; i++)
            p.in[1][i] *= 1000.0;
        p.out_line = 2 * 3 * (size_t)n;
        break;
    case CENTRAL_DIFFERENCE: case DIFFERENCE_WEIGHTS:
        lines(&p, 0, m, m, &state);
        numbers(&p, 1, 0, (size_t)m, &state);
        for (i = 0; i < m; i++)
            p.in[1][i] += 3 * i;
        p.out_line = routine == CENTRAL_DIFFERENCE ? 8 : 2 * (size_t)m;
        break;
    case PROJECT_ON_JOINT: case JOINT_FORMS:
        p.size[3] = 4;
        p.size[4] = p.flag ? n * (n + 1) / 2 : n * n;
        p.size[2] = variant & 2 ? p.flag ? n * (joint + 1) : joint * joint : 0;
        lines(&p, 0, joint, joint, &state);
        numbers(&p, 1, (size_t)joint * (size_t)joint, 0, &state);
        for (i = 0; i < (int)p.in_all[1]; i++)
            p.in[1][i] = 2.0 + p.in[1][i];
        numbers(&p, 2, (size_t)p.size[2] * (size_t)p.size[2], 0, &state);
        for (i = 3; i <= 5; i++)
            lines(&p, i, n, n, &state);
        p.out_line = routine == PROJECT_ON_JOINT ? 4 * (size_t)(n * n)
                                                 : 2 * (size_t)p.size[4] * (size_t)(p.size[4] + 1);
        break;
    case POLLUTE:
        p.letters[0] = noises[variant];
        p.letters[1] = "ELS"[variant % 3];
        lines(&p, 0, n, n, &state);
        p.out_line = 2 * (size_t)n * (size_t)n * REALISATIONS;
        break;
    case BRICK_MATRICES: case BRICK_QUALITY:
        p.letters[0] = "RIF"[variant];
        elements(&p, &state);
        p.out_line = routine == BRICK_MATRICES ? 2 * 576 : 2;
        break;
    case EXPECT_ON_JOINT:
        p.size[2] = variant & 2 ? p.flag ? n * (joint + 1) : joint * joint : 0;
        lines(&p, 0, n, n, &state);
        numbers(&p, 1, (size_t)joint * (size_t)joint, 0, &state);
        numbers(&p, 2, (size_t)p.size[2] * (size_t)p.size[2], 0, &state);
        numbers(&p, 3, (size_t)n * (size_t)n, 0, &state);
        for (k = 1; k <= 3; k += 2)
            for (i = 0; i < (int)p.in_all[k]; i++)
                p.in[k][i] = 2.0 + p.in[k][i];
        for (i = 4; i <= 5; i++)
            lines(&p, i, n, n, &state);
        p.out_line = 4 * (size_t)(n * n);
        break;
    case FIT_DIAGONAL_JOINT: case LOWEST_DIAGONAL_JOINT:
        p.size[1] = joint;
        p.size[3] = 5;
        for (i = 0; i < joint; i++) {
            p.dofs[0][i] = 1 + i % (n > 0 ? n : 1);
            p.dofs[1][i] = i / (n > 0 ? n : 1);
        }
        frequencies(&p, &state);
        lines(&p, 1, n, 1, &state);
        regular(&p, 2, n, &state);
        numbers(&p, 3, 0, 3 * (size_t)joint, &state);
        for (i = 0; i < joint; i++) {
            p.in[3][i] = -4.0;
            p.in[3][joint + i] = 4.0;
        }
        lines(&p, 4, n, 1, &state);
        numbers(&p, 5, 1, 0, &state);
        p.out_line = (size_t)(joint * joint + 2 * joint + 1);
        break;
    case JOINT_NORMAL_EQUATIONS:
        p.size[1] = joint;
        p.size[2] = n * (n + 1) / 2;
        for (i = 0; i < joint; i++) {
            p.dofs[0][i] = 1 + i % (n > 0 ? n : 1);
            p.dofs[1][i] = 1 + (i / 2) % (n > 0 ? n : 1);
        }
        lines(&p, 0, joint, 1, &state);
        lines(&p, 1, p.size[2], 1, &state);
        lines(&p, 2, p.size[2], p.size[2], &state);
        lines(&p, 3, p.size[2], 1, &state);
        p.out_line = (size_t)(joint * joint + joint);
        break;
    case RATIONAL_FIT: case RELOCATE_POLES:
        p.size[1] = 3;
        p.size[3] = 3;
        lines(&p, 0, 1, 1, &state);
        for (i = 0; i < n_freq; i++) {
            p.in[0][2 * i] = 0.0;
            p.in[0][2 * i + 1] = 1.0 + (double)i / n_freq;
        }
        lines(&p, 1, 3, 1, &state);
        numbers(&p, 2, 3, 0, &state);
        for (i = 0; i < (int)p.in_all[2]; i++)
            p.in[2][i] = 2.0 + p.in[2][i];
        numbers(&p, 3, 0, joint, &state);
        for (i = 0; i < n; i++) {
            p.in[3][2 * i] = -0.05;
            p.in[3][2 * i + 1] = 1.0 + (i + 0.5) / n;
        }
        p.out_line = 6;
        break;
    case SMOOTH_FRFS:
        p.size[1] = 3;
        p.size[2] = 0;
        p.size[3] = 2;
        numbers(&p, 0, 1, 0, &state);
        for (i = 0; i < n_freq; i++)
            p.in[0][i] = 10.0 + i;
        lines(&p, 1, 3, 1, &state);
        numbers(&p, 2, 3, 0, &state);
        for (i = 0; i < (int)p.in_all[2]; i++)
            p.in[2][i] = 2.0 + p.in[2][i];
        p.out_line = 6;
        break;
    case ESTIMATE_NOISE:
        frequencies(&p, &state);
        lines(&p, 1, n, 1, &state);
        lines(&p, 2, n, 1, &state);
        numbers(&p, 3, 0, (size_t)n, &state);
        numbers(&p, 4, (size_t)n, 0, &state);
        for (k = 3; k <= 4; k++)
            for (i = 0; i < (int)p.in_all[k]; i++)
                p.in[k][i] = fabs(p.in[k][i]);
        p.out_line = (size_t)n + 2;
        break;
    case LINE_CORRELATION: case LINE_LEVELS:
        lines(&p, 0, n, 1, &state);
        p.out_line = routine == LINE_LEVELS ? 2 : 2 * (size_t)n;
        break;
    case NOISE_PARTS:
        p.size[1] = 2;
        numbers(&p, 0, (size_t)n, 0, &state);
        numbers(&p, 1, 2 * (size_t)n, 0, &state);
        for (k = 0; k < 2; k++)
            for (i = 0; i < (int)p.in_all[k]; i++)
                p.in[k][i] = fabs(p.in[k][i]);
        p.out_line = 1;
        break;
    case START_JOINT: case FIT_JOINT:
        p.size[1] = n + 1;
        p.size[3] = p.size[4] = joint;
        p.size[2] = variant & 2 ? p.flag ? n * (joint + 1) : joint * joint : 0;
        for (i = 0; i <= n; i++) {
            p.dofs[0][i] = 1 + i % (n > 0 ? n : 1);
            p.dofs[1][i] = i == n ? 2 : 0;
        }
        regular(&p, 0, joint, &state);
        numbers(&p, 1, (size_t)joint * (size_t)joint, 0, &state);
        for (i = 0; i < (int)p.in_all[1]; i++)
            p.in[1][i] = 2.0 + p.in[1][i];
        numbers(&p, 2, (size_t)p.size[2] * (size_t)p.size[2], 0, &state);
        regular(&p, 3, joint, &state);
        numbers(&p, 4, 1, 0, &state);
        numbers(&p, 5, 0, (size_t)n, &state);
        for (i = 0; i < n; i++)
            p.in[5][i] = 2.0 + p.in[5][i];
        /* Results by line, and those of all lines. */
        p.out_line = 6 * (size_t)(n * n) + 5 * (size_t)n + 3;
        p.out_line += 2 * (size_t)((n + 1) * (n + 1)) + 4 * (size_t)n + 5;
    }
    return p;
}

void free_problem(problem *p)
{
    int k;

    for (k = 0; k < MOST_INPUTS; k++)
        free(p->in[k]);
}

/* A line of complex input k becomes value times the unit matrix. */
static void set_unit(problem *p, int k, int line, double value)
{
    const size_t count = p->in_line[k], n = (size_t)sqrt((double)count / 2 + 0.5);
    double *a = p->in[k] + count * (size_t)line;
    size_t i;

    memset(a, 0, count * sizeof *a);
    for (i = 0; i < n; i++)
        a[2 * (i * n + i)] = value;
}

/* What is tiny where the rest is large, so that results overflow: the blocks beside the diagonal of the first input. */
static int is_tiny(int input, size_t entry, size_t entries)
{
    size_t order = 0;

    while ((order + 1) * (order + 1) <= entries)
        order++;
    return input == 0 && (order == 0 || order % 2 == 1 || entry / order / (order / 2) != entry % order / (order / 2));
}

void spoil(problem *p, int line, char how)
{
    const int by_omega = p->routine >= RECEPTANCE && p->routine <= RECEPTANCE_MODAL;
    const int inputs = p->routine >= BRICK_MATRICES ? 1 : MOST_INPUTS;
    const double factor = how == 'h' ? 1e306 : how == 'l' ? 1e150 : how == 'm' ? 1e-156 : how == 't' ? 1e-310 : 0.0;
    int k;
    size_t i;

    if (p->routine >= SMOOTH_FRFS)      /* refuses all lines where one is wrong */
        return;
    for (k = 0; k < inputs; k++) {
        double *a = p->in[k] + p->in_line[k] * (size_t)line;

        if (p->in_line[k] == 0)
            continue;
        if (how == 'n' && k == 0)
            a[p->in_line[k] - 1] = NAN;
        if (how == 'i' && k == 0)
            a[p->in_line[k] - 1] = INFINITY;
        if (how == 's' && !by_omega && p->routine < BRICK_MATRICES && !(p->routine == COMPLIANCE_COVARIANCE && k == 2))
            set_unit(p, k, line, k == 0 ? 1.0 : k == 1 && p->routine == COUPLE ? 0.0 : -1.0);
        for (i = 0; i < p->in_line[k]; i++)
            if (how == 'o')
                a[i] *= is_tiny(k, i / 2, p->in_line[k] / 2) ? 1e-310 : 1e150;
            else if (strchr("hlmt0", how) || (how == 's' && by_omega))
                a[i] *= factor;
    }
}

int make_wrong(problem *p, int kind)
{
    switch (kind) {
    case 0: p->trans = 'x'; break;
    case 1: p->n_freq = -1; break;
    case 2: case 3: case 4: case 5: case 6: case 7: case 8: p->size[kind - 2] = -1; break;
    case 9: case 10: case 11: case 12: p->dofs[kind - 9][0] = 0; break;
    case 13: case 14: case 15: case 16: p->dofs[kind - 13][0] = MOST_DOFS; break;
    case 17: case 18: case 19: case 20: p->dofs[kind - 17][1] = p->dofs[kind - 17][0]; break;
    case 21: p->number = NAN; break;
    case 22: p->letters[0] = 'x'; break;
    case 23: p->flag = 2; break;
    case 24: p->size[3] = p->routine == TRANSFORM ? -2 : p->size[0] + 1; break;
    case 25: p->size[5] = p->size[0] + 1; break;
    default: return 0;
    }
    return 1;
}
