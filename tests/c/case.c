/* The chain of Table 3-1 (thesis case 3.1) through the flat face, from C. tests/f77/case.f does the same and reads
 * alike.
 *
 * ground-k1-m1-k2-m2 =joint= m3-k3-m4-k4-ground. A: m1, m2. B: m3, m4. The joint lies between m2 and m3, 2000 N/m and
 * 3 N s/m; the first estimate K0 is half of it.
 *
 * Output, one value a line, blanks between: name, line (from 1), real part, imaginary part, with 17 significant digits.
 * Matrix entries are name(out,in), counted from 1. Names: h_a, h_b receptances; h_c, h_c0 assembly through K* and K0;
 * k_ismm, k_short, k_rr identified joint stiffness; c_joint joint compliance. Exit status 1 if anything is wrong.
 */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "jointfrf.h"

#define NF 5

/* Stop where a call did not go well, and say in words what it was. */
static void test(int info)
{
    char text[80];
    int n_text = sizeof text;

    if (info == JF_INFO_GOOD)
        return;
    jf_info_text(&info, &n_text, text);
    printf("%.*s\n", n_text, text);
    exit(1);
}

/* Stop where a joint stiffness is not the one that was put in. */
static void agree(jf_complex found, jf_complex exact)
{
    if (cabs(found - exact) <= 1e-10 * cabs(exact))
        return;
    printf("joint stiffness %g %g instead of %g %g\n", creal(found), cimag(found), creal(exact), cimag(exact));
    exit(1);
}

static void print(const char *name, int n, const jf_complex *h)
{
    for (int k = 0; k < NF; k++)
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                jf_complex z = h[(k * n + i) * n + j];
                printf("%s(%d,%d) %d %25.16e %25.16e\n", name, i + 1, j + 1, k + 1, creal(z), cimag(z));
            }
}

int main(void)
{
    const double freq_hz[NF] = {1, 2, 4, 6, 8};
    /* K, M and C of A (grounded at m1) and of B (grounded at m4) */
    const double k_a[2][2] = {{6000, -3500}, {-3500, 3500}}, m_a[2][2] = {{5, 0}, {0, 3}};
    const double c_a[2][2] = {{7, -4}, {-4, 4}};
    const double k_b[2][2] = {{2000, -2000}, {-2000, 4500}}, m_b[2][2] = {{4, 0}, {0, 2}};
    const double c_b[2][2] = {{2, -2}, {-2, 3}};
    const double pi = acos(-1.0), no_loss = 0.0;
    const int zero = 0, one = 1, two = 2, n_freq = NF, dofs[2] = {1, 2}, dof_j = 2, dof_k = 1, dof_r = 1, dof_s = 2;
    double omega[NF], rcond[NF];
    jf_complex h_a[NF][2][2], h_b[NF][2][2], h_c[NF][4][4], h_c0[NF][4][4];
    jf_complex k_joint[NF], k_initial[NF], gamma[NF][2][2], alpha[NF][2][2], h_rr[NF];
    jf_complex k_ismm[NF], k_short[NF], k_rr[NF], c_joint[NF];
    int line_info[NF], info;

    for (int i = 0; i < NF; i++) {
        omega[i] = 2.0 * pi * freq_hz[i];
        k_joint[i] = 2000.0 + 3.0 * omega[i] * I;
        k_initial[i] = 1000.0 + 1.5 * omega[i] * I;
    }

    /* receptances of A and B */
    jf_receptance("T", &two, &n_freq, &two, &two, omega, *k_a, *m_a, &two, *c_a, &zero, *c_a, &no_loss, dofs, dofs,
                  **h_a, line_info, rcond, &info);
    test(info);
    jf_receptance("T", &two, &n_freq, &two, &two, omega, *k_b, *m_b, &two, *c_b, &zero, *c_b, &no_loss, dofs, dofs,
                  **h_b, line_info, rcond, &info);
    test(info);

    /* the assembly through the joint and through the first estimate */
    jf_couple("T", &two, &two, &one, &n_freq, **h_a, **h_b, k_joint, &dof_j, &dof_k, **h_c, line_info, rcond, &info);
    test(info);
    jf_couple("T", &two, &two, &one, &n_freq, **h_a, **h_b, k_initial, &dof_j, &dof_k, **h_c0, line_info, rcond, &info);
    test(info);

    /* receptances at the joint (DOFs 2 and 3 of the assembly), and at m1 */
    for (int i = 0; i < NF; i++) {
        for (int m = 0; m < 2; m++)
            for (int n = 0; n < 2; n++) {
                gamma[i][m][n] = h_c[i][m + 1][n + 1];
                alpha[i][m][n] = h_c0[i][m + 1][n + 1];
            }
        h_rr[i] = h_c[i][0][0];
    }

    /* the joint again, three ways, and its compliance */
    jf_ismm("T", &one, &n_freq, **alpha, **gamma, k_initial, k_ismm, line_info, rcond, &info);
    test(info);
    jf_inverse_substructuring("T", &one, &n_freq, **gamma, k_short, line_info, rcond, &info);
    test(info);
    jf_decouple("rr", "T", &two, &two, &one, &n_freq, **h_a, **h_b, h_rr, &dof_j, &dof_k, &dof_r, &dof_s, k_rr,
                line_info, rcond, &info);
    test(info);
    jf_joint_compliance("T", &one, &n_freq, **gamma, c_joint, line_info, rcond, &info);
    test(info);

    print("h_a", 2, **h_a);
    print("h_b", 2, **h_b);
    print("h_c", 4, **h_c);
    print("h_c0", 4, **h_c0);
    print("k_ismm", 1, k_ismm);
    print("k_short", 1, k_short);
    print("k_rr", 1, k_rr);
    print("c_joint", 1, c_joint);

    for (int i = 0; i < NF; i++) {
        agree(k_ismm[i], k_joint[i]);
        agree(k_short[i], k_joint[i]);
        agree(k_rr[i], k_joint[i]);
        agree(1.0 / c_joint[i], k_joint[i]);
    }
    return 0;
}
