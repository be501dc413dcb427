"""Two beams and a joint (thesis case 3.2), from Python.

The same case, alike line by line: tests/f77/case.f, tests/fortran/case.f90, tests/c/case.c.

A is clamped, two Euler-Bernoulli elements; B is free, one element. They are joined in deflection and rotation. The
assembly through the actual joint K* stands for a measurement, the one through a first estimate K0 for a model. The
joint comes back by ISMM and by inverse substructuring, as means over sensitive bands.

Output, 17 significant digits: name(out,in), line, real part, imaginary part of gamma, k_ismm, k_short on all lines;
then the means, method by method: k_Fy, k_Mtheta, c_Fy, c_Mtheta. Exit status 1 if anything is wrong.
"""

import numpy as np

import jointfrf as jf

N, N_FREQ = 4, 178
LOSS = 0.01
# the joint's DOFs on A, on B, in the assembly; Python counts them from 0
DOFS_A, DOFS_B, DOFS_C = [2, 3], [0, 1], [2, 3, 4, 5]
FREQ_HZ = 15 + 5.0 * np.arange(N_FREQ)
OMEGA = 2 * np.pi * FREQ_HZ


def beam(length, n_elements, n_fix):
    """Stiffness and consistent mass of a beam, N/m and kg.

    The first n_fix of its DOFs (deflection and rotation of each node) are held. As jf.beam, in the order of operations
    of the other three languages.
    """
    youngs_modulus, density, width, height = 67e9, 2700, 0.025, 0.006
    table_k = [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
    table_m = [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
    a = length / n_elements
    s = youngs_modulus * (width * height * height * height / 12) / (a * a * a)
    w = density * (width * height) * a / 420
    u = [1, a, 1, a]
    k, m = np.zeros((N, N)), np.zeros((N, N))
    for e in range(n_elements):
        for i in range(4):
            for j in range(4):
                p, q = 2 * e + i - n_fix, 2 * e + j - n_fix
                if p < 0 or q < 0:
                    continue
                k[p, q] += s * table_k[i][j] * u[i] * u[j]
                m[p, q] += w * table_m[i][j] * u[i] * u[j]
    return k, m


def print_lines(name, h):
    for line, matrix in enumerate(h, 1):
        for i, row in enumerate(matrix, 1):
            for j, z in enumerate(row, 1):
                print(f"{name}({i},{j}){line:4d} {z.real:24.16E} {z.imag:24.16E}")


def print_means(k):
    """Print means of k and c over the sensitive bands: 200 to 900 Hz for deflection, 15 to 200 Hz for rotation.

    As jf.band_mean, in the order of operations of the other three languages.
    """
    low, high = [200, 15], [900, 200]
    mean_k, mean_c = [0.0, 0.0], [0.0, 0.0]
    for j in range(2):
        count = 0
        for line in range(N_FREQ):
            if FREQ_HZ[line] < low[j] or FREQ_HZ[line] > high[j]:
                continue
            mean_k[j] += k[line, j, j].real
            mean_c[j] += k[line, j, j].imag / OMEGA[line]
            count += 1
        mean_k[j] /= count
        mean_c[j] /= count
    print(f"k_Fy {mean_k[0]:24.16E}\nk_Mtheta {mean_k[1]:24.16E}")
    print(f"c_Fy {mean_c[0]:24.16E}\nc_Mtheta {mean_c[1]:24.16E}")


def main():
    # the joint: stiffness N/m, N m/rad; damping N s/m, N m s/rad
    k_joint = jf.Joint([6e6, 5e3], [50, 15]).dynamic_stiffness(FREQ_HZ)
    k_initial = jf.Joint([1e6, 1e3], [25, 5]).dynamic_stiffness(FREQ_HZ)

    # receptances of A and B
    k_a, m_a = beam(0.300, 2, 2)
    k_b, m_b = beam(0.225, 1, 0)
    h_a = jf.receptance(FREQ_HZ, k_a, m_a, loss_factor=LOSS)
    h_b = jf.receptance(FREQ_HZ, k_b, m_b, loss_factor=LOSS)

    # the assembly through the joint and through the first estimate
    h_c = jf.couple(h_a, h_b, k_joint, DOFS_A, DOFS_B)
    h_c0 = jf.couple(h_a, h_b, k_initial, DOFS_A, DOFS_B)

    # its receptances at the joint
    gamma = h_c[:, DOFS_C][:, :, DOFS_C]
    alpha = h_c0[:, DOFS_C][:, :, DOFS_C]

    # the joint again, two ways
    k_ismm = jf.ismm(alpha, gamma, k_initial)
    k_short = jf.inverse_substructuring(gamma)

    print_lines("gamma", gamma)
    print_lines("k_ismm", k_ismm)
    print_lines("k_short", k_short)
    print_means(k_ismm)
    print_means(k_short)


if __name__ == "__main__":
    main()
