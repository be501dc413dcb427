"""Two beams with six DOFs at the joint, without solid elements: bending in two planes, axial motion and torsion."""

import numpy as np

import jointfrf as jf

E, NU, RHO, LOSS = 70e9, 0.33, 2700.0, 0.01
LENGTH, WIDTH, THICKNESS = 0.3, 0.025, 0.006

#: Table 4-1 in its order.
DOFS = ("x", "theta_y", "y", "theta_x", "z", "theta_z")
JOINT = jf.Joint([1e6, 1e4, 1e6, 1e3, 1e7, 1e3], [10, 10, 30, 5, 20, 5], DOFS)
FREQ = np.arange(1.0, 601.0)


def _full(diagonal, seed):
    """Full symmetric positive definite matrix with this diagonal."""
    mixed = np.random.default_rng(seed).standard_normal((6, 24))
    whole = mixed @ mixed.T
    return whole * np.sqrt(np.outer(diagonal, diagonal) / np.outer(whole.diagonal(), whole.diagonal()))


#: All 21 stiffnesses and 21 dampings.
FULL = jf.Joint(_full(JOINT.stiffness.diagonal(), 1), _full(JOINT.damping.diagonal(), 2), DOFS)
#: By symmetry the FRFs between these vanish: x, theta_y, theta_z and y, theta_x, z.
GROUPS = ((0, 1, 5), (2, 3, 4))


def bar(freq, stiffness, mass, clamped):
    """Receptance of the end of a uniform bar, EA and rho A or GJ and rho I_p, the other end clamped or free."""
    stiffness = stiffness * (1 + 1j * LOSS)
    wave = 2 * np.pi * freq * np.sqrt(mass / stiffness)
    return np.tan(wave * LENGTH) / (stiffness * wave) if clamped else -1 / (np.tan(wave * LENGTH) * stiffness * wave)


def side(freq, clamped, offset):
    """Receptance of one beam at its joint end, order `DOFS`, for a reference point at an offset from its axis.

    The axis of a beam is z, its thickness is along y. Bending in x has the slope theta_y, in y the slope -theta_x.
    """
    ends, node = (("clamped", "free"), "21") if clamped else (("free", "free"), "1")
    h = np.zeros((freq.size, 6, 6), complex)
    for width, height, dofs, sign in ((WIDTH, THICKNESS, [2, 3], -1), (THICKNESS, WIDTH, [0, 1], 1)):
        model = jf.beam(
            LENGTH, 20, youngs_modulus=E, density=RHO, width=width, height=height, ends=ends, loss_factor=LOSS
        )
        signs = np.array([1, sign])
        own = model.receptance(freq, model.index(f"{node}:y", f"{node}:theta")) * signs[:, None] * signs
        h[:, np.array(dofs)[:, None], dofs] = own
    area, polar = WIDTH * THICKNESS, WIDTH * THICKNESS * (WIDTH**2 + THICKNESS**2) / 12
    torsion = E / (2 * (1 + NU)) * WIDTH * THICKNESS**3 / 3 * (1 - 0.63 * THICKNESS / WIDTH)
    h[:, 4, 4] = bar(freq, E * area, RHO * area, clamped)
    h[:, 5, 5] = bar(freq, torsion, RHO * polar, clamped)
    x, y, z = offset
    turn = np.eye(6)  # u + theta x offset, written out
    turn[0, 1], turn[0, 5] = z, -y
    turn[2, 5], turn[2, 3] = x, -z
    turn[4, 3], turn[4, 1] = y, -x
    return turn @ h @ turn.T


def sides(freq=FREQ, *, across=0.0, order=range(6)):
    """Receptances of both beams, reference points on the outer faces, 6 mm from the axes, and `across` to the side."""
    order = np.array(order)
    a, b = side(freq, True, (across, -0.006, 0)), side(freq, False, (across, 0.006, 0))
    return tuple(np.ascontiguousarray(h[:, order[:, None], order]) for h in (a, b))


def assembly(joint=JOINT, freq=FREQ, *, across=0.0, order=range(6)):
    """FRFs of the assembly at the joint: DOFs j, then k."""
    a, b = sides(freq, across=across, order=order)
    return jf.couple(a, b, joint.dynamic_stiffness(freq), range(6), range(6))
