/* The joint of two beams (thesis case 3.3) from noisy FRFs at it, with standard errors, from C. The same program, alike
 * line by line: tests/f77/identify.f, tests/fortran/identify.f90, tests/python/support/identify_joint.py.
 *
 * A is clamped, 300 elements of 1 mm; B is free, 225 elements; the elements are linear with shear and lumped mass. A
 * joint in deflection and rotation connects them. Its stiffness and damping come from FRFs at both sides of it, 15 to
 * 800 Hz, to which 5 % noise was added.
 *
 * Output, 6 significant digits: each parameter, its value and its standard error. Exit status 1 if anything is wrong.
 */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "jointfrf.h"

enum { N_A = 600, N_B = 452, N_J = 2, N_PAR = 4, N_FREQ = 786, N_NEAR = 2 };

static const double level = 0.05;
static const jf_int n_j = N_J, n_gamma = 2 * N_J, n_par = N_PAR, n_freq = N_FREQ, none = 0, one = 1;
static double omega[N_FREQ], rcond[N_FREQ];
static jf_int line_info[N_FREQ];

/* Stop where a call did not go well, and say in words what it was. */
static void test(jf_int info)
{
    char text[81] = "";
    const jf_int length = 80;

    if (info == 0)
        return;
    jf_info_text(&info, &length, text);
    puts(text);
    exit(1);
}

/* Receptance at two DOFs of a beam of n DOFs, deflection and rotation of each node. The first n_fix are held. K and M
 * are band matrices with three diagonals on each side: entry (p, q), counted from 0, at [q][3 + p - q]. */
static void beam(double length, jf_int n, int n_elements, int n_fix, const jf_int tip[N_J], jf_complex *h)
{
    const double youngs_modulus = 67e9, poisson = 0.33, density = 2700, width = 0.025, height = 0.006, loss = 0.01;
    const double a = length / n_elements;
    const double bending = youngs_modulus * (width * height * height * height / 12);
    const double shear = 0.85 * youngs_modulus / (2 * (1 + poisson)) * (width * height)
                         / (1 + 0.25 * a * a / (height * height));
    const double turn[4] = {0, -1 / a, 0, 1 / a}, angle[4] = {-1 / a, -0.5, 1 / a, -0.5};
    const double by_area = 0.5 * a * density * (width * height);
    const double by_inertia = 0.5 * a * density * (width * height * height * height / 12);
    const double mass[4] = {by_area, by_inertia, by_area, by_inertia};
    static double k[N_A][7], m[N_A][7];
    const jf_int three = 3;
    jf_int info;

    for (int q = 0; q < n; q++)
        for (int p = 0; p < 7; p++)
            k[q][p] = m[q][p] = 0;
    for (int e = 0; e < n_elements; e++)
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                int p = 2 * e + i - n_fix, q = 2 * e + j - n_fix;
                if (p < 0 || q < 0)
                    continue;
                k[q][3 + p - q] = k[q][3 + p - q] + a * (bending * turn[i] * turn[j] + shear * angle[i] * angle[j]);
                if (i == j)
                    m[q][3] = m[q][3] + mass[i];
            }
    jf_receptance_banded("T", &n, &three, &three, &n_freq, &n_j, &n_j, omega, *k, *m, &none, *k, &none, *k, &loss, tip,
                         tip, h, line_info, rcond, &info);
    test(info);
}

int main(void)
{
    static const jf_int tip_a[N_J] = {599, 600}, tip_b[N_J] = {1, 2}, joint_dofs[N_J] = {1, 2}, seed[2] = {1, 0};
    /* the DOF of each parameter, and its kind: 0 stiffness, 2 viscous damping */
    static const jf_int dofs[N_PAR] = {1, 2, 1, 2}, kinds[N_PAR] = {0, 0, 2, 2}, patience = 8;
    static const char *const names[N_PAR] = {"k_Fy", "k_Mtheta", "c_Fy", "c_Mtheta"};
    static const double farthest = 0;
    static jf_complex h_a[N_FREQ][N_J][N_J], h_b[N_FREQ][N_J][N_J], k_joint[N_FREQ][N_J][N_J];
    static jf_complex gamma[N_FREQ][2 * N_J][2 * N_J], measured[N_FREQ][2 * N_J][2 * N_J];
    static jf_complex free_h[N_FREQ][N_J][N_J], free_q[N_FREQ][N_J][N_J], information[N_FREQ][N_J][N_J];
    static jf_complex c_joint[N_FREQ][N_J], gradient[N_FREQ][N_J];
    static double inverse_std[N_FREQ][2 * N_J][2 * N_J], line_descent[N_FREQ][N_PAR], distance[N_FREQ], squares[N_FREQ];
    static jf_int used[N_FREQ];
    double spring[N_J], x[N_PAR], values[N_PAR], covariance[N_PAR][N_PAR], normal[N_PAR][N_PAR], descent[N_PAR];
    double whitening[1], cost, equations;
    const double pi = 4 * atan(1.0);
    jf_int iterations, converged, info;

    for (int l = 0; l < N_FREQ; l++)
        omega[l] = 2 * pi * (15.0 + l);

    /* FRFs at the joint, coupled through it, and noise on them */
    beam(0.300, N_A, 300, 2, tip_a, **h_a);
    beam(0.225, N_B, 225, 0, tip_b, **h_b);
    for (int l = 0; l < N_FREQ; l++) {
        k_joint[l][0][0] = 6e5 + 20 * omega[l] * I;
        k_joint[l][1][1] = 5e3 + 1.5 * omega[l] * I;
    }
    jf_couple("T", &n_j, &n_j, &n_j, &n_freq, **h_a, **h_b, **k_joint, joint_dofs, joint_dofs, **gamma, line_info,
              rcond, &info);
    test(info);
    jf_pollute("T", "C", "E", &none, &one, &level, seed, &n_gamma, &n_gamma, &n_freq, &none, &one, **gamma, **measured,
               &info);
    test(info);

    /* the mean of both directions, and one over the standard deviation of its noise, by the mean over neighbouring
     * lines */
    for (int l = 0; l < N_FREQ; l++)
        for (int i = 0; i < 2 * N_J; i++)
            for (int j = 0; j < 2 * N_J; j++)
                gamma[l][i][j] = 0.5 * (measured[l][i][j] + measured[l][j][i]);
    for (int l = 0; l < N_FREQ; l++) {
        const int first = l - N_NEAR > 0 ? l - N_NEAR : 0, last = l + N_NEAR < N_FREQ - 1 ? l + N_NEAR : N_FREQ - 1;

        for (int i = 0; i < 2 * N_J; i++)
            for (int j = 0; j < 2 * N_J; j++) {
                double s = 0;

                for (int k = first; k <= last; k++)
                    s = s + creal(gamma[k][i][j]) * creal(gamma[k][i][j])
                        + cimag(gamma[k][i][j]) * cimag(gamma[k][i][j]);
                inverse_std[l][i][j] = sqrt((last - first + 1) / s) / level;
                if (i != j)
                    inverse_std[l][i][j] = inverse_std[l][i][j] * sqrt(2.0);
            }
    }

    /* the joint */
    jf_fit_joint("T", &one, &n_j, &n_par, &n_gamma, &n_gamma, &none, &n_freq, &none, &patience, &none, &farthest, dofs,
                 kinds, omega, **gamma, **gamma, **inverse_std, whitening, spring, x, **free_h, **free_q, values,
                 *covariance, *normal, descent, &cost, &equations, *line_descent, distance, used, *c_joint,
                 **information, *gradient, squares, &iterations, &converged, line_info, &info);
    test(info);
    if (converged != 1)
        return 1;
    for (int i = 0; i < N_PAR; i++)
        printf("%-8s %13.5E %13.5E\n", names[i], values[i], sqrt(covariance[i][i]));
    return 0;
}
