/* Every routine that computes, behind one call, and random problems for it with lines that are good or spoiled. */
#ifndef CALLS_H
#define CALLS_H

#include <stddef.h>

#include "jointfrf.h"

enum {
    INVERT,
    SOLVE,
    RECEPTANCE,
    RECEPTANCE_BANDED,
    RECEPTANCE_MODAL,
    COUPLE,
    MODIFY,
    FIND_MODIFICATION,
    ISMM,
    INVERSE_SUBSTRUCTURING,
    DECOUPLE,
    JOINT_COMPLIANCE,
    COMPLIANCE_FACTORS,
    COMPLIANCE_COVARIANCE,
    TRANSFORM,
    WORK_ROUTINES,      /* those before have a form in memory of the caller */
    CENTRAL_DIFFERENCE = WORK_ROUTINES,
    PROJECT_ON_JOINT,
    JOINT_FORMS,
    POLLUTE,
    MONTE_CARLO,
    BRICK_MATRICES,
    BRICK_QUALITY,
    DIFFERENCE_WEIGHTS,
    EXPECT_ON_JOINT,
    FIT_DIAGONAL_JOINT,
    JOINT_NORMAL_EQUATIONS,
    RATIONAL_FIT,
    RELOCATE_POLES,
    SMOOTH_FRFS,
    ESTIMATE_NOISE,
    LINE_CORRELATION,
    LINE_LEVELS,
    NOISE_PARTS,
    LOWEST_DIAGONAL_JOINT,
    START_JOINT,
    FIT_JOINT,
    ROUTINES
};

#define MOST_DOFS 256
#define MOST_INPUTS 6
#define REALISATIONS 3

/* The arguments of one routine. Input k has in_line[k] numbers a line; 0: all lines share its in_all[k] numbers. */
typedef struct {
    int routine;
    char trans, letters[3];
    jf_int n_freq, size[7], flag;
    double number;              /* loss factor, level, hourglass stiffness */
    jf_int dofs[4][MOST_DOFS];
    double *in[MOST_INPUTS];
    size_t in_line[MOST_INPUTS], in_all[MOST_INPUTS], out_line;
} problem;

/* Workspace as jf_NAME_work takes it. */
typedef struct {
    jf_complex *work;
    jf_int lwork;
    jf_int *iwork;
    jf_int liwork;
} workspace;

/* What a call gives, with numbers around it that it must not touch. */
typedef struct {
    unsigned char *bytes;
    size_t n_bytes;
    double *out, *rcond;
    jf_int *line_info, info;
} outcome;

/* Checks that count; `what` names the case. */
extern int checks, failures;
extern char what[100];
void check(int condition, const char *claim);

extern const char *const routine_name[ROUTINES];
extern const int lwork_argument[WORK_ROUTINES];

int variants(int routine);
/* Matrices of order n or a few more, every line good. */
problem new_problem(int routine, char trans, int n, int n_freq, int variant);
void free_problem(problem *p);
/* n NaN, i Inf, 0 zeros, s singular, h huge, l large, m small, t tiny */
void spoil(problem *p, int line, char how);
/* Makes one argument wrong, where the routine takes it; 0 where there is no such kind. */
int make_wrong(problem *p, int kind);

outcome new_outcome(const problem *p);
void free_outcome(outcome *o);
void clear(outcome *o);
int guards_stay(const outcome *o);
int untouched(const outcome *o);
int same(const outcome *a, const outcome *b);

/* Results that are arguments as well, as they are before the call. */
void begin(const problem *p, double *out);
/* Without a workspace the routine itself, with one its form in memory of the caller. */
jf_int call(const problem *p, const workspace *w, double *out, jf_int *line_info, double *rcond);
void call_into(const problem *p, const workspace *w, outcome *o);
/* The same for one line, which the next call does not disturb. */
jf_int call_line(const problem *p, int line, const workspace *w, outcome *o);

#endif
