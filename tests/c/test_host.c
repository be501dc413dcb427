/* A host program survives calls with nonsense: the library prints nothing, stops nothing, writes nothing where an
   argument is wrong and no further than the workspace it is given, and leaves rounding, masks and modes of the
   floating-point unit as they were. */
#define _GNU_SOURCE
#include <fenv.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "jointfrf.h"

#define CALLS 100000
#define MOST 6          /* largest order and number of DOFs */
#define LINES 4         /* most lines */
#define ROOM 10400      /* numbers in a result: as many as the largest call writes */
#define GIVEN 1200      /* numbers in an argument, likewise */
#define WORK 6000       /* numbers in a workspace, more than any call takes */

static unsigned long long state = 88172645463325252ULL;

static unsigned next(unsigned below)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (unsigned)((state >> 20) % below);
}

/* Mostly a size that is possible. */
static jf_int any_size(int most)
{
    static const int strange[] = {-1, -30000, 0, -7, INT_MIN};

    return next(5) ? 1 + (int)next((unsigned)most) : strange[next(5)];
}

/* A size that may be no larger than others are. */
static jf_int any_part(int most)
{
    return next(40) ? any_size(most) : INT_MAX;
}

static jf_int any_length(void)
{
    return next(4) ? WORK / 6 : next(2) ? (int)next(WORK / 6) : next(2) ? WORK : any_size(2);
}

static double any_number(void)
{
    static const double strange[] = {0.0, -0.0, INFINITY, -INFINITY, NAN, 1e308, -1e308, 5e-324, 1e-308};

    return next(12) ? (next(2001) - 1000.0) / 500.0 : strange[next(9)];
}

static char any_letter(void)
{
    static const char letters[] = "NnTtRrIiFfSsCcPpUuEeLlXx?\0 ";

    return next(4) ? letters[next(4)] : letters[next(sizeof letters)];
}

static double in[6][GIVEN];
static double out[2][ROOM], before[2][ROOM];
static jf_int dofs[4][8 * MOST], line_info[256], line_info_before[256];
static double work[2 * WORK], work_before[2 * WORK];
static jf_int iwork[WORK], iwork_before[WORK], lwork, liwork;
static int in_work;     /* whether the last call was one in memory of the caller */

/* New arguments: one array of numbers a call, all indices. */
static void fill(int number)
{
    int i, k;

    for (i = 0; i < GIVEN; i++)
        in[number % 6][i] = any_number();
    for (k = 0; k < 4; k++)
        for (i = 0; i < 8 * MOST; i++)
            dofs[k][i] = next(8) ? 1 + (i + (int)next(2)) % MOST
                                 : next(9) ? (int)next(12) - 4 : next(2) ? INT_MIN : INT_MAX;
    memset(out, 0x5a, sizeof out);
    memcpy(before, out, sizeof before);
    memset(line_info, 0x5a, sizeof line_info);
    memcpy(line_info_before, line_info, sizeof line_info_before);
}

static const jf_complex *frf(int k)
{
    return (const jf_complex *)in[k];
}

/* With or without workspace. */
#define CALL(name, ...)                                                                                              \
    do {                                                                                                             \
        if (in_work)                                                                                                 \
            jf_##name##_work(__VA_ARGS__, line_info, rcond, (jf_complex *)work, &lwork, iwork, &liwork, &info);      \
        else                                                                                                         \
            jf_##name(__VA_ARGS__, line_info, rcond, &info);                                                         \
    } while (0)

/* One call of one routine with arguments as they come; returns its info. */
static jf_int call(void)
{
    const char t = any_letter(), kind = any_letter(), reference = any_letter();
    const char equation[2] = {any_letter(), any_letter()};
    const jf_int n = any_size(MOST), m = any_size(MOST), p = any_size(MOST), q = any_size(MOST);
    const jf_int n_freq = any_size(LINES), flag = (int)next(4) - 1;
    const double number = any_number();
    jf_complex *h = (jf_complex *)out[0];
    double *rcond = out[1];
    const jf_int part = any_part(MOST), n_damping = next(3) ? (int)next(2) * n : any_part(MOST);
    const jf_int n_structural = next(3) ? (int)next(2) * n : any_part(MOST), kl = next(40) ? flag : INT_MAX;
    const int routine = (int)next(31);
    const jf_int few = any_size(2), order = few > 0 ? few : 1;
    const jf_int n_free = next(20) ? flag == 1 ? order * (order + 1) / 2 : order * order : m;
    const jf_int n_correlated = next(3) ? 0 : next(9) ? flag == 1 ? order * (2 * order + 1) : 4 * order * order : m;
    jf_complex *second = (jf_complex *)out[1];
    double *squares = out[1] + ROOM / 2;
    jf_int info = 12345;

    lwork = any_length();
    liwork = any_length();
    in_work = (routine < 14 || routine == 16) && next(2);
    switch (routine) {
    case 0: CALL(invert, &n, &n_freq, frf(0), h); break;
    case 1: CALL(solve, &t, &n, &m, &n_freq, frf(0), frf(1), h); break;
    case 2:
        CALL(receptance, &t, &n, &n_freq, &m, &p, in[2], in[0], in[1], &n_damping, in[3], &n_structural, in[4], &number,
             dofs[0], dofs[1], h);
        break;
    case 3:
        CALL(receptance_banded, &t, &n, &kl, &q, &n_freq, &m, &p, in[2], in[0], in[1], &n_damping, in[3], &n_structural,
             in[4], &number, dofs[0], dofs[1], h);
        break;
    case 4: CALL(receptance_modal, &t, &n, &n_freq, &m, &p, in[0], in[1], in[2], in[3], in[4], in[5], h); break;
    case 5: CALL(couple, &t, &n, &m, &part, &n_freq, frf(0), frf(1), frf(2), dofs[0], dofs[1], h); break;
    case 6: CALL(modify, &t, &n, &part, &n_freq, frf(0), frf(1), dofs[0], h); break;
    case 7: CALL(find_modification, &t, &n, &n_freq, frf(0), frf(1), h); break;
    case 8: CALL(ismm, &t, &n, &n_freq, frf(0), frf(1), frf(2), h); break;
    case 9: CALL(inverse_substructuring, &t, &n, &n_freq, frf(0), h); break;
    case 10:
        CALL(decouple, equation, &t, &n, &m, &part, &n_freq, frf(0), frf(1), frf(2), dofs[0], dofs[1], dofs[2],
             dofs[3], h);
        break;
    case 11: CALL(joint_compliance, &t, &n, &n_freq, frf(0), h); break;
    case 12: CALL(compliance_factors, &t, &n, &m, &n_freq, frf(0), in[1], h); break;
    case 13: CALL(compliance_covariance, &t, &flag, &n, &m, &n_freq, frf(0), in[1], in[2], h); break;
    case 14: jf_difference_weights(&n, in[0], out[0], &info); break;
    case 15: jf_central_difference(&t, &n, &n_freq, in[0], frf(1), h, line_info, rcond, &info); break;
    case 16: CALL(transform, &t, &n, &m, &p, &q, &n_freq, frf(0), in[1], in[2], h); break;
    case 17:
        jf_pollute(&t, &kind, &reference, &flag, &m, &number, dofs[3], &n, &p, &n_freq, &flag, &q, frf(0), h, &info);
        break;
    case 18:
        jf_brick_matrices(&t, &n_freq, in[0], in[1], in[2], in[3], &number, &flag, out[0], out[1], line_info, &info);
        break;
    case 19:
        jf_project_on_joint(&t, &flag, &few, &n_correlated, &n_freq, &q, &number, frf(0), in[1], in[2], frf(3), h, second,
                            squares, line_info, &info);
        break;
    case 20:
        jf_joint_forms(&t, &flag, &few, &n_free, &n_correlated, &n_freq, &m, frf(0), in[1], in[2], frf(3), frf(4), frf(5),
                       h, second, squares, line_info, &info);
        break;
    case 21:
        jf_relocate_poles(&n, &m, &n_freq, &p, &number, frf(0), frf(1), in[2], h, out[1], &info);
        break;
    case 22: jf_rational_fit(&n, &m, &n_freq, frf(0), frf(1), in[2], frf(3), h, out[1], out[1] + 1, &info); break;
    case 23: {
        const jf_int n_par = next(10) ? n > 0 ? n + (jf_int)next(2 * (unsigned)n + 1) : n : m;
        jf_int own[3 * MOST], kinds[3 * MOST];
        double lower[3 * MOST], upper[3 * MOST];
        int i;

        for (i = 0; i < 3 * MOST; i++) {
            own[i] = next(60) ? 1 + i % (n > 0 ? n : 1) : dofs[0][i];
            kinds[i] = next(60) ? i / (n > 0 ? n : 1) : dofs[1][i];
            lower[i] = next(20) ? -fabs(in[4][i]) : in[4][i];
            upper[i] = next(20) ? fabs(in[4][i]) : in[5][i];
        }
        jf_fit_diagonal_joint(&t, &flag, &n, &n_par, &n_freq, &q, &p, &number, own, kinds, lower, upper, in[3], frf(0),
                              frf(1), frf(2), in[4], out[1], out[0], out[1] + 50, out[1] + 100, &info);
        break;
    }
    case 24:
        jf_expect_on_joint(&t, &flag, &few, &n_correlated, &n_freq, &number, in[1], in[2], in[3], frf(0), h, second, line_info,
                           &info);
        break;
    case 25: {
        const jf_int n_par = next(10) ? 1 + (jf_int)next(3 * MOST) : m, entries = next(20) ? order * (order + 1) / 2 : n_free;

        jf_joint_normal_equations(&t, &few, &n_par, &entries, &n_freq, dofs[0], dofs[1], frf(0), frf(1), frf(2), frf(3),
                                  out[0], out[1], &info);
        break;
    }
    case 26: {
        jf_int n_found;

        jf_smooth_frfs(&m, &n_freq, &n, &q, &p, &number, in[0], frf(1), in[2], h, &n_found, second, squares, &info);
        break;
    }
    case 27: {
        jf_int is_shaped;

        jf_estimate_noise(&m, &n_freq, &p, &flag, in[0], frf(1), frf(2), in[3], in[4], dofs[0], dofs[1], &number, out[0],
                          out[1], out[0] + 100, out[0] + 200, &is_shaped, squares, &info);
        break;
    }
    case 28: jf_line_correlation(&m, &n_freq, h, &number, squares, &info); break;
    case 29: jf_line_levels(&m, &n_freq, frf(0), &number, &flag, out[0], out[1], &info); break;
    case 30: jf_noise_parts(&t, &n, &m, &n_freq, in[0], in[1], out[0], &info); break;
    default: jf_brick_quality(&n_freq, in[0], out[0], out[1], &info);
    }
    return info;
}

/* Whether nothing was written behind so many numbers and integers; then these are as before. */
static int workspace_kept(jf_int numbers, jf_int integers)
{
    const size_t used = 2 * (size_t)numbers, i_used = (size_t)integers;
    const int kept = memcmp(work + used, work_before + used, sizeof work - used * sizeof *work) == 0
                     && memcmp(iwork + i_used, iwork_before + i_used, sizeof iwork - i_used * sizeof *iwork) == 0;

    memcpy(work, work_before, used * sizeof *work);
    memcpy(iwork, iwork_before, i_used * sizeof *iwork);
    return kept;
}

static unsigned modes(void)
{
    unsigned found = (unsigned)fegetround();
#if defined(__GLIBC__)
    found = 1000 * found + (unsigned)fegetexcept();
#endif
#if defined(__x86_64__)
    found ^= _mm_getcsr() & 0xffc0u; /* masks, rounding, flush to zero, denormals are zero */
#endif
    return found;
}

int main(void)
{
    const int screen = dup(STDERR_FILENO);
    FILE *said = tmpfile();
    const unsigned modes_before = modes();
    int i, refused = 0, answered = 0, failures = 0;
    long printed;

    if (screen < 0 || said == NULL || dup2(fileno(said), STDOUT_FILENO) < 0 || dup2(fileno(said), STDERR_FILENO) < 0)
        return 2;
    memset(work, 0x6b, sizeof work);
    memcpy(work_before, work, sizeof work);
    memset(iwork, 0x6b, sizeof iwork);
    memcpy(iwork_before, iwork, sizeof iwork);
    for (i = 0; i < 6; i++)
        fill(i);
    for (i = 0; i < CALLS; i++) {
        jf_int info;
        int query;

        fill(i);
        info = call();
        query = in_work && (lwork == -1 || liwork == -1);
        if (info == 12345)
            failures++;
        if (!in_work || info < 0)
            failures += !workspace_kept(0, 0);
        else
            failures += query ? !workspace_kept(1, 1) : !workspace_kept(lwork, liwork);
        if (info >= 0 && !query) {
            answered++;
            continue;
        }
        refused++;
        if (memcmp(out, before, sizeof out) != 0 || memcmp(line_info, line_info_before, sizeof line_info) != 0)
            failures++;
    }
    fflush(stdout);
    fflush(stderr);
    printed = lseek(fileno(said), 0, SEEK_END);
    dup2(screen, STDERR_FILENO);
    if (printed != 0) {
        char text[2000];

        rewind(said);
        fprintf(stderr, "FAILED: the library printed %ld bytes:\n", printed);
        fwrite(text, 1, fread(text, 1, sizeof text, said), stderr);
    }
    if (failures != 0)
        fprintf(stderr, "FAILED: %d calls wrote what they must not, or left info as it was\n", failures);
    if (modes() != modes_before)
        fprintf(stderr, "FAILED: the floating-point modes have changed\n");
    if (refused < CALLS / 10 || answered < CALLS / 10)
        fprintf(stderr, "FAILED: %d refused and %d answered calls: the arguments are no test\n", refused, answered);
    return printed != 0 || failures != 0 || modes() != modes_before || refused < CALLS / 10 || answered < CALLS / 10;
}
