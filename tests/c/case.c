/* Two beams and a joint (thesis case 3.2), from C. The same case, alike line by line: tests/f77/case.f,
 * tests/fortran/case.f90, tests/python/support/case.py.
 *
 * A is clamped, two Euler-Bernoulli elements; B is free, one element. They are joined in deflection and rotation. The
 * assembly through the actual joint K* stands for a measurement, the one through a first estimate K0 for a model. The
 * joint comes back by ISMM and by inverse substructuring, as means over sensitive bands.
 *
 * Output, 17 significant digits: name(out,in), line, real part, imaginary part of gamma, k_ismm, k_short on all lines;
 * then the means, method by method: k_Fy, k_Mtheta, c_Fy, c_Mtheta. Exit status 1 if anything is wrong.
 */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "jointfrf.h"

enum { N = 4, N_J = 2, N_FREQ = 178 };

static double freq_hz[N_FREQ], omega[N_FREQ];

/* Stiffness and consistent mass of a beam, N/m and kg. The first n_fix of its DOFs (deflection and rotation of each
 * node) are held. */
static void beam(double length, int n_elements, int n_fix, double k[N][N], double m[N][N])
{
    const double youngs_modulus = 67e9, density = 2700, width = 0.025, height = 0.006;
    const double table_k[4][4] = {{12, 6, -12, 6}, {6, 4, -6, 2}, {-12, -6, 12, -6}, {6, 2, -6, 4}};
    const double table_m[4][4] = {{156, 22, 54, -13}, {22, 4, 13, -3}, {54, 13, 156, -22}, {-13, -3, -22, 4}};
    const double a = length / n_elements;
    const double s = youngs_modulus * (width * height * height * height / 12) / (a * a * a);
    const double w = density * (width * height) * a / 420;
    const double u[4] = {1, a, 1, a};

    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            k[i][j] = m[i][j] = 0;
    for (int e = 0; e < n_elements; e++)
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                int p = 2 * e + i - n_fix, q = 2 * e + j - n_fix;
                if (p < 0 || q < 0)
                    continue;
                k[p][q] = k[p][q] + s * table_k[i][j] * u[i] * u[j];
                m[p][q] = m[p][q] + w * table_m[i][j] * u[i] * u[j];
            }
}

/* K* = k + i w c of a joint in deflection and rotation. */
static void joint(const double stiffness[N_J], const double damping[N_J], jf_complex k[N_FREQ][N_J][N_J])
{
    for (int l = 0; l < N_FREQ; l++)
        for (int i = 0; i < N_J; i++)
            for (int j = 0; j < N_J; j++)
                k[l][i][j] = i == j ? stiffness[j] + omega[l] * damping[j] * I : 0;
}

/* Stop where a call did not go well, and say in words what it was. */
static void test(jf_int info)
{
    char text[80];
    jf_int n_text = sizeof text;

    if (info == JF_INFO_GOOD)
        return;
    jf_info_text(&info, &n_text, text);
    printf("%.*s\n", (int)n_text, text);
    exit(1);
}

static void print_lines(const char *name, int n, const jf_complex *h)
{
    for (int l = 0; l < N_FREQ; l++)
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                jf_complex z = h[(l * n + i) * n + j];
                printf("%s(%d,%d)%4d %24.16E %24.16E\n", name, i + 1, j + 1, l + 1, creal(z), cimag(z));
            }
}

/* Print means of k and c over the sensitive bands: 200 to 900 Hz for deflection, 15 to 200 Hz for rotation. */
static void print_means(jf_complex k[N_FREQ][N_J][N_J])
{
    const double low[N_J] = {200, 15}, high[N_J] = {900, 200};
    double mean_k[N_J], mean_c[N_J];

    for (int j = 0; j < N_J; j++) {
        int count = 0;
        mean_k[j] = mean_c[j] = 0;
        for (int l = 0; l < N_FREQ; l++) {
            if (freq_hz[l] < low[j] || freq_hz[l] > high[j])
                continue;
            mean_k[j] = mean_k[j] + creal(k[l][j][j]);
            mean_c[j] = mean_c[j] + cimag(k[l][j][j]) / omega[l];
            count = count + 1;
        }
        mean_k[j] = mean_k[j] / count;
        mean_c[j] = mean_c[j] / count;
    }
    printf("k_Fy %24.16E\nk_Mtheta %24.16E\n", mean_k[0], mean_k[1]);
    printf("c_Fy %24.16E\nc_Mtheta %24.16E\n", mean_c[0], mean_c[1]);
}

int main(void)
{
    const jf_int n = N, n_j = N_J, n_freq = N_FREQ, none = 0;
    const double loss = 0.01, pi = acos(-1.0);
    /* all DOFs of a beam; the joint's on A, on B, in the assembly; all count from 1 */
    const jf_int all_dofs[N] = {1, 2, 3, 4}, dofs_a[N_J] = {3, 4}, dofs_b[N_J] = {1, 2}, dofs_c[2 * N_J] = {3, 4, 5, 6};
    static double k_a[N][N], m_a[N][N], k_b[N][N], m_b[N][N], rcond[N_FREQ];
    static jf_complex h_a[N_FREQ][N][N], h_b[N_FREQ][N][N], h_c[N_FREQ][2 * N][2 * N], h_c0[N_FREQ][2 * N][2 * N];
    static jf_complex k_joint[N_FREQ][N_J][N_J], k_initial[N_FREQ][N_J][N_J];
    static jf_complex gamma[N_FREQ][2 * N_J][2 * N_J], alpha[N_FREQ][2 * N_J][2 * N_J];
    static jf_complex k_ismm[N_FREQ][N_J][N_J], k_short[N_FREQ][N_J][N_J];
    static jf_int line_info[N_FREQ];
    jf_int info;

    for (int l = 0; l < N_FREQ; l++) {
        freq_hz[l] = 15 + 5.0 * l;
        omega[l] = 2 * pi * freq_hz[l];
    }

    /* the joint: stiffness N/m, N m/rad; damping N s/m, N m s/rad */
    joint((double[]){6e6, 5e3}, (double[]){50, 15}, k_joint);
    joint((double[]){1e6, 1e3}, (double[]){25, 5}, k_initial);

    /* receptances of A and B */
    beam(0.300, 2, 2, k_a, m_a);
    beam(0.225, 1, 0, k_b, m_b);
    jf_receptance("T", &n, &n_freq, &n, &n, omega, *k_a, *m_a, &none, *k_a, &none, *k_a, &loss, all_dofs, all_dofs,
                  **h_a, line_info, rcond, &info);
    test(info);
    jf_receptance("T", &n, &n_freq, &n, &n, omega, *k_b, *m_b, &none, *k_b, &none, *k_b, &loss, all_dofs, all_dofs,
                  **h_b, line_info, rcond, &info);
    test(info);

    /* the assembly through the joint and through the first estimate */
    jf_couple("T", &n, &n, &n_j, &n_freq, **h_a, **h_b, **k_joint, dofs_a, dofs_b, **h_c, line_info, rcond, &info);
    test(info);
    jf_couple("T", &n, &n, &n_j, &n_freq, **h_a, **h_b, **k_initial, dofs_a, dofs_b, **h_c0, line_info, rcond, &info);
    test(info);

    /* its receptances at the joint */
    for (int l = 0; l < N_FREQ; l++)
        for (int i = 0; i < 2 * N_J; i++)
            for (int j = 0; j < 2 * N_J; j++) {
                gamma[l][i][j] = h_c[l][dofs_c[i] - 1][dofs_c[j] - 1];
                alpha[l][i][j] = h_c0[l][dofs_c[i] - 1][dofs_c[j] - 1];
            }

    /* the joint again, two ways */
    jf_ismm("T", &n_j, &n_freq, **alpha, **gamma, **k_initial, **k_ismm, line_info, rcond, &info);
    test(info);
    jf_inverse_substructuring("T", &n_j, &n_freq, **gamma, **k_short, line_info, rcond, &info);
    test(info);

    print_lines("gamma", 2 * N_J, **gamma);
    print_lines("k_ismm", N_J, **k_ismm);
    print_lines("k_short", N_J, **k_short);
    print_means(k_ismm);
    print_means(k_short);
    return 0;
}
