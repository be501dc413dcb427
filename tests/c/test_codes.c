/* The codes that jointfrf.h names are those that the kernel returns, each provoked by a call. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__linux__)
#include <sys/resource.h>
#endif

#include "jointfrf.h"

static int failures = 0;

static void check(int good, const char *what)
{
    if (good)
        return;
    failures++;
    fprintf(stderr, "FAILED: %s\n", what);
}

static void check_text(void (*routine)(const jf_int *, const jf_int *, char *), jf_int code, const char *expected)
{
    char text[81];
    jf_int n_text = 80;

    text[80] = '\0';
    routine(&code, &n_text, text);
    check(strncmp(text, expected, strlen(expected)) == 0, expected);
    check(strspn(text + strlen(expected), " ") == 80 - strlen(expected), "a text is padded with blanks");
}

/* Two lines of order 1, the second as given. */
static void check_line(double value, jf_int expected, const char *what)
{
    const jf_int n = 1, n_freq = 2;
    jf_complex a[2] = {2.0, value}, a_inverse[2];
    jf_int line_info[2], info;
    double rcond[2];

    jf_invert(&n, &n_freq, a, a_inverse, line_info, rcond, &info);
    check(line_info[1] == expected, what);
    check(info == (expected != JF_LINE_GOOD), "number of bad lines");
    check(line_info[0] == JF_LINE_GOOD && creal(a_inverse[0]) == 0.5, "the line beside it");
    check((expected == JF_LINE_GOOD) == !isnan(creal(a_inverse[1])), "a bad line is NaN");
    check((expected == JF_LINE_GOOD) == (rcond[1] > 0.0), "rcond of a bad line");
}

/* The choice is kept, and an engine that no machine has leaves it as it is. */
static void check_engines(void)
{
    const jf_int engines[] = {JF_ENGINE_LAPACK, JF_ENGINE_PLAIN, JF_ENGINE_X86_64_V2, JF_ENGINE_X86_64_V3,
                              JF_ENGINE_X86_64_V4};
    const jf_int automatic = JF_ENGINE_AUTOMATIC, lapack = JF_ENGINE_LAPACK, none = 6;
    jf_int engine, info, widest = 0, before;

    for (int i = 0; i < 5; i++) {
        jf_get_engine(&before, &info);
        jf_set_engine(&engines[i], &info);
        check(info == 0 || (info == -1 && i >= 2), "an engine is there or it is not");
        if (info == 0 && i >= 1)
            widest = engines[i];
        jf_get_engine(&engine, &info);
        check(info == JF_INFO_GOOD && (engine == engines[i] || engine == before), "the engine in use");
    }
    jf_set_engine(&lapack, &info);
    jf_set_engine(&none, &info);
    check(info == -1, "an engine that does not exist");
    jf_get_engine(&engine, &info);
    check(engine == JF_ENGINE_LAPACK, "JF_ENGINE_LAPACK");
    jf_set_engine(&automatic, &info);
    jf_get_engine(&engine, &info);
    check(info == JF_INFO_GOOD && engine == widest, "JF_ENGINE_AUTOMATIC is the widest");
}

/* Two million forces on a thousand DOFs: 32 GB of workspace where 8 GB are allowed. */
static void check_no_memory(void)
{
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
    const jf_int n = 1000, n_freq = 1, n_out = 0, n_in = 2000000, zero = 0;
    const double omega = 1.0, loss_factor = 0.0;
    const struct rlimit limit = {8000000000u, 8000000000u};
    double *matrix = calloc((size_t)n * n, sizeof *matrix), rcond = 0.5;
    jf_complex h;
    jf_int *inputs = malloc((size_t)n_in * sizeof *inputs), line_info = 7, info = 0;

    if (!matrix || !inputs || setrlimit(RLIMIT_AS, &limit) != 0) {
        check(0, "cannot set up the test of missing memory");
        return;
    }
    for (jf_int i = 0; i < n_in; i++)
        inputs[i] = 1;
    jf_receptance("N", &n, &n_freq, &n_out, &n_in, &omega, matrix, matrix, &zero, matrix, &zero, matrix, &loss_factor,
                  inputs, inputs, &h, &line_info, &rcond, &info);
    check(info == JF_INFO_NO_MEMORY, "JF_INFO_NO_MEMORY");
    free(inputs);
    free(matrix);
#endif
}

int main(void)
{
    const jf_int n = -1, n_freq = 1;
    jf_int info = 7;

    check_text(jf_info_text, JF_INFO_GOOD, "good");
    check_text(jf_info_text, JF_INFO_NO_MEMORY, "the workspace could not be allocated");
    check_text(jf_info_text, JF_INFO_NO_ENGINE, "JOINTFRF_ENGINE names an engine that this machine does not have");
    check_text(jf_info_text, -2, "argument 2 is wrong");
    check_text(jf_line_text, JF_LINE_GOOD, "good");
    check_text(jf_line_text, JF_LINE_NOT_FINITE, "the line holds NaN or Inf");
    check_text(jf_line_text, JF_LINE_OVERFLOW, "the result of the line is not finite");

    check_line(4.0, JF_LINE_GOOD, "JF_LINE_GOOD");
    check_line(0.0, 1, "singular");
    check_line(NAN, JF_LINE_NOT_FINITE, "JF_LINE_NOT_FINITE, NaN");
    check_line(-INFINITY, JF_LINE_NOT_FINITE, "JF_LINE_NOT_FINITE, Inf");
    check_line(1e-310, JF_LINE_OVERFLOW, "JF_LINE_OVERFLOW");

    jf_invert(&n, &n_freq, NULL, NULL, NULL, NULL, &info);
    check(info == -1, "a wrong argument");
    check_engines();
    check_no_memory();
    return failures > 0;
}
