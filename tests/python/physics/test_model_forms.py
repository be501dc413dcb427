"""Small models: full and sparse matrices give the same receptances, and are refused in the same words."""

import numpy as np
import pytest
from scipy import sparse

import jointfrf as jf

FORMS = [sparse.csr_array, sparse.csc_array, sparse.coo_array, sparse.csc_matrix, sparse.lil_array]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("method", ["auto", "dense", "modal"])
@pytest.mark.parametrize("n", [1, 4, 12, 64])
def test_small_sparse_models_have_the_bits_of_full_ones(n, method, form):
    model = jf.chain(np.linspace(1, 2, n), np.full(n, 1e4), ground="start")
    full = [model.stiffness.toarray(), model.mass.toarray()]
    freq, dofs = np.linspace(0, 40, 20), [n - 1, 0, 0]
    for chosen in ({}, {"outputs": dofs, "inputs": dofs[:1]}):
        of_full, of_sparse = (
            jf.receptance(freq, k, m, 1e-4 * k, 0.01, 1e-3 * k, method=method, **chosen)
            for k, m in (full, [form(a) for a in full])
        )
        np.testing.assert_array_equal(of_full, of_sparse)


def _told(make, *arguments, **named):
    with pytest.raises((ValueError, TypeError)) as caught:
        make(*arguments, **named)
    return type(caught.value), str(caught.value)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("method", ["auto", "dense", "modal"])
@pytest.mark.parametrize("name", ["stiffness", "mass", "damping", "structural_damping"])
def test_small_sparse_models_are_refused_in_the_words_of_full_ones(name, method, form):
    k, m = np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]]), np.diag([1.0, 2, 3])
    whole = {"stiffness": k, "mass": m, "damping": 1e-3 * k, "structural_damping": 1e-2 * k}
    broken = k.copy()
    broken[2, 1] = np.nan
    endless = k.copy()
    endless[1, 2] = endless[2, 1] = np.inf
    wrong = [broken, endless, np.tril(k), np.triu(k), k[:2], 1j * k]
    if name != "stiffness":
        wrong.append(np.eye(2))
    if name in ("stiffness", "mass") and method == "modal":
        wrong.append(k + np.eye(3, k=2))
    for bad in wrong:
        given = whole | {name: bad}
        sparse_ones = {key: form(matrix) for key, matrix in given.items()}
        assert _told(jf.receptance, [1.0], method=method, **given) == _told(
            jf.receptance, [1.0], method=method, **sparse_ones
        )


def test_dofs_that_are_asked_for_twice_are_those_of_two_lists():
    k, m = np.array([[2.0, -1], [-1, 1]]), np.eye(2)
    dofs = [1, 0, 1]
    one = jf.receptance([0.1, 0.2], k, m, loss_factor=0.1, outputs=dofs, inputs=dofs)
    np.testing.assert_array_equal(one, jf.receptance([0.1, 0.2], k, m, None, 0.1, outputs=dofs, inputs=list(dofs)))
    assert _told(jf.receptance, [1.0], k, m, outputs=[2], inputs=[2]) == (
        ValueError,
        "outputs names DOF 2; there are DOFs 0 to 1",
    )
