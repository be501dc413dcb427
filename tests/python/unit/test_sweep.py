"""What goes in and out of the kernel: shapes, types, memory, bad lines."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.kernel import arguments, call


def test_invert_and_solve_against_numpy(random_lines):
    a, b = random_lines(7, 5, seed=1), random_lines(7, 5, 3, seed=2)
    np.testing.assert_allclose(jf.invert(a), np.linalg.inv(a), rtol=1e-10)
    np.testing.assert_allclose(jf.solve(a, b), np.linalg.solve(a, b), rtol=1e-10)
    size, size_inverse = ((abs(z.real) + abs(z.imag)).sum(axis=2).max(axis=1) for z in (a, np.linalg.inv(a)))
    rcond = jf.reciprocal_condition(a)
    np.testing.assert_allclose(rcond, 1 / (size * size_inverse), rtol=1e-8)
    ratio = rcond * np.linalg.cond(a, np.inf)
    assert (ratio <= 1).all()
    assert (ratio >= 0.5).all()


@pytest.mark.parametrize("n", [33, 100])
def test_large_matrices(random_lines, n):
    a, b = random_lines(3, n, seed=3), random_lines(3, n, 2, seed=4)
    np.testing.assert_allclose(jf.solve(a, b), np.linalg.solve(a, b), rtol=1e-8)
    np.testing.assert_allclose(a @ jf.invert(a), np.broadcast_to(np.eye(n), a.shape), atol=1e-10)


@pytest.mark.parametrize(("n_freq", "n"), [(0, 3), (3, 0), (0, 0), (1, 1)])
def test_sizes_without_content(n_freq, n):
    a = np.ones((n_freq, n, n))
    assert jf.invert(a).shape == (n_freq, n, n)
    assert jf.solve(a, np.ones((n_freq, n, 2))).shape == (n_freq, n, 2)
    assert jf.reciprocal_condition(a).shape == (n_freq,)


def test_c_order_goes_through_untouched(monkeypatch, random_lines):
    """The kernel reads the caller's own memory and writes into the array that is returned."""
    seen = {}
    kernel = call._kernel.jf_invert

    def spy(n, n_freq, a, result, *rest):
        seen.update(a=a, result=result)
        return kernel(n, n_freq, a, result, *rest)

    monkeypatch.setattr(call._kernel, "jf_invert", spy)
    a = random_lines(4, 3)
    a.setflags(write=False)
    kept = a.copy()
    result = jf.invert(a)
    assert np.shares_memory(seen["a"], a)
    assert seen["a"].__array_interface__["data"][0] == a.__array_interface__["data"][0]
    assert np.shares_memory(seen["result"], result)
    assert seen["a"].flags.f_contiguous
    assert seen["result"].flags.f_contiguous
    assert result.flags.c_contiguous
    assert (a == kept).all()


def test_f2py_makes_no_copy_of_the_view_either(random_lines):
    """Results written into a view appear in the array behind it."""
    a = random_lines(4, 3)
    result, info, rcond = np.zeros_like(a), np.ones(4, np.int32), np.zeros(4)
    assert call._kernel.jf_invert(3, 4, a.T, result.T, info, rcond) == 0
    np.testing.assert_allclose(result, np.linalg.inv(a), rtol=1e-10)
    assert not info.any()
    for wrong in (result.T.astype(np.complex64), result.T[:, ::-1], np.zeros((4, 3, 3), complex)):
        with pytest.raises(Exception, match=r"intent\(inout\)|failed in converting|shape|dimension|expected"):
            call._kernel.jf_invert(3, 4, a.T, wrong, info, rcond)


@pytest.mark.parametrize(
    "make",
    [
        lambda a: a.astype(np.complex64).astype(np.complex128),
        lambda a: np.asfortranarray(a),
        lambda a: np.repeat(a, 2, axis=0)[::2],
        lambda a: a[::-1][::-1],
        lambda a: a.tolist(),
        lambda a: a.astype(">c16"),
    ],
)
def test_any_layout_gives_the_same(make, random_lines):
    a = random_lines(4, 3).astype(np.complex64).astype(np.complex128)
    np.testing.assert_array_equal(jf.invert(make(a)), jf.invert(a))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.complex64, np.int32, bool])
def test_other_number_types_are_converted(dtype):
    a = np.array([[[1, 0], [1, 1]]]).astype(dtype)
    result = jf.invert(a)
    assert result.dtype == np.complex128
    np.testing.assert_allclose(result, [[[1, 0], [-1, 1]]])


@pytest.mark.parametrize("wrong", [np.array([[["a"]]]), np.array([[[None]]], dtype=object)])
def test_what_is_no_number_is_a_type_error(wrong):
    with pytest.raises(TypeError, match="a must contain numbers"):
        jf.invert(wrong)


def test_a_large_copy_is_announced(monkeypatch):
    monkeypatch.setattr(arguments, "LARGE_COPY", 1000)
    a = np.broadcast_to(np.eye(4), (20, 4, 4))
    with pytest.warns(jf.CopyWarning, match=r"a is of type float64: a copy of 0 MiB"):
        jf.invert(a)
    with pytest.warns(jf.CopyWarning, match="not contiguous in C order"):
        jf.invert(np.asfortranarray(a.astype(complex)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        jf.invert(np.ascontiguousarray(a.astype(complex)))


@pytest.mark.parametrize("bad", [np.nan, np.inf, complex(0, np.inf)])
def test_nan_and_inf_are_named_by_argument_line_and_frequency(random_lines, bad):
    a = random_lines(4, 2)
    a[2, 0, 1] = bad
    freq = np.array([1.0, 2.0, 3.5, 4.0])
    with pytest.raises(ValueError, match=r"a: NaN or Inf in line 2 \(3.5 Hz\)"):
        jf.invert(a, freq_hz=freq)
    kept = jf.invert(a, on_singular="nan")
    assert np.isnan(kept[2]).all()
    np.testing.assert_allclose(kept[[0, 1, 3]], np.linalg.inv(a[[0, 1, 3]]), rtol=1e-10)
    with pytest.raises(ValueError, match=r"^b: NaN or Inf in line 2"):
        jf.solve(random_lines(4, 2), a)


def test_singular_lines_are_listed(random_lines):
    a = random_lines(6, 2)
    a[[1, 4]] = [[1, 2], [2, 4]]
    with pytest.raises(
        jf.SingularLineError, match=r"invert: singular matrix in line 1 \(20 Hz\), line 4 \(50 Hz\)"
    ) as caught:
        jf.invert(a, freq_hz=np.arange(10.0, 70, 10))
    assert isinstance(caught.value, np.linalg.LinAlgError)
    assert caught.value.lines.tolist() == [1, 4]
    assert caught.value.freq_hz.tolist() == [20.0, 50.0]
    kept = jf.invert(a, on_singular="nan")
    assert np.isnan(kept[[1, 4]]).all()
    assert np.isfinite(kept[[0, 2, 3, 5]]).all()


def test_an_overflow_is_told():
    with pytest.raises(OverflowError, match="line 0"):
        jf.invert(np.full((1, 1, 1), 1e-320))


def test_ill_conditioned_lines_warn(random_lines):
    a = random_lines(3, 2)
    a[1] = [[1, 1], [1, 1 + 1e-13]]
    with pytest.warns(jf.IllConditionedWarning, match=r"1 of 3 lines are ill-conditioned, worst line 1"):
        jf.invert(a)


def test_every_scale_from_1e_minus_150_to_1e150(random_lines):
    a = random_lines(5, 4)
    for scale in (1e-150, 1e-75, 1e75, 1e150):
        np.testing.assert_allclose(jf.invert(a * scale) * scale, np.linalg.inv(a), rtol=1e-9)
        np.testing.assert_allclose(jf.reciprocal_condition(a * scale), jf.reciprocal_condition(a), rtol=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda g: jf.invert(g[0]), r"a must have shape \(n_freq, n, n\), not \(4, 4\)"),
        (lambda g: jf.invert(g[:, :2]), "a must contain square matrices, not 2 x 4"),
        (lambda g: jf.solve(g, g[:2]), r"b must have shape \(3, 4, n\)"),
        (lambda g: jf.invert(g, freq_hz=[1.0]), r"freq_hz must have shape \(3\)"),
        (lambda g: jf.invert(g, on_singular="ignore"), "on_singular must be one of raise, nan"),
        (lambda g: jf.couple(g, g, np.eye(2), [0, 4], [0, 1]), "dofs_a names DOF 4; there are DOFs 0 to 3"),
        (lambda g: jf.couple(g, g, np.eye(2), [0, 0], [0, 1]), "dofs_a names a DOF twice"),
        (lambda g: jf.couple(g, g, np.eye(2), [0, 1], [0]), "same number of DOFs"),
        (lambda g: jf.couple(g, g, np.eye(3), [0, 1], [0, 1]), r"k_joint must have shape \(3, 2, 2\)"),
        (lambda g: jf.couple(g, g[:2], np.eye(2), [0, 1], [0, 1]), r"h_b must have shape \(3, n, n\)"),
        (lambda g: jf.couple(g, g, np.eye(0), [], []), "at least one"),
        (lambda g: jf.modify(g, np.eye(1), []), "at least one DOF"),
        (lambda g: jf.ismm(g, g[:, :2, :2], np.eye(2)), "gamma must have the shape of alpha"),
        (lambda g: jf.ismm(g[:, :3, :3], g, np.eye(2)), "must contain DOFs j and k, an even number of rows, not 3"),
        (lambda g: jf.inverse_substructuring(np.zeros((3, 0, 0))), "an even number of rows, not 0"),
        (lambda g: jf.find_modification(g, g[:, :2, :2]), "gamma must have the shape of alpha"),
        (lambda g: jf.decouple("rk", g, g, g[:, :1, :1], [0], [0]), "equation must be one of rr, rs, sr, ss"),
        (lambda g: jf.decouple("rr", g, g, g[:, :1, :1], [0], [0]), "equation 'rr' needs dofs_r"),
        (lambda g: jf.decouple("ss", g, g, g[:, :1, :1], [0], [0], dofs_s=[1, 2]), "dofs_s must name 1 DOFs"),
        (lambda g: jf.decouple("ss", g, g, g, [0], [0], dofs_s=[1]), r"h_c must have shape \(3, 1, 1\)"),
        (lambda g: jf.compliance_covariance(g, -abs(g)), "variance must not be negative"),
        (lambda g: jf.compliance_covariance(g, np.ones((3, 2, 2))), r"variance must have shape \(3, 4, 4\)"),
        (lambda g: jf.central_difference(g[:, :3, :3], 0.0), "spacing must be positive"),
        (lambda g: jf.central_difference(g, 0.1), r"h must have shape \(n_freq, 3, 3\)"),
        (lambda g: jf.central_difference(g[:, :2, :2], [0.1, 0.1]), "no two equal"),
        (lambda g: jf.central_difference(g[:, :1, :1], [0.1]), "at least two points"),
        (lambda g: jf.central_difference(g[:, :3, :3], 0.1, sign=2), "sign must be 1 or -1"),
        (lambda g: jf.transform(g, np.eye(3), np.eye(4)), r"t_out must have shape \(n, 4\)"),
        (lambda g: jf.difference_error(0.1, -1.0, 1.0), "must be positive"),
    ],
)
def test_bad_arguments_get_one_sentence(call, message, random_lines):
    with pytest.raises(ValueError, match=message):
        call(random_lines(3, 4))


def test_dofs_must_be_whole_numbers(random_lines):
    g = random_lines(2, 2)
    with pytest.raises(TypeError, match="dofs_a must be a list of DOF numbers"):
        jf.couple(g, g, np.eye(1), [0.0], [0])


def test_threads_do_not_change_a_bit(random_lines, threads):
    """The same lines in short sweeps (one thread) and in a long one (four), 64 lines to a share of a thread."""
    if threads is None:
        pytest.skip("needs OpenMP and /proc")
    threads(4)
    a = random_lines(4000, 6)
    whole = jf.invert(a)
    pieces = np.concatenate([jf.invert(a[i : i + 64]) for i in range(0, 4000, 64)])
    np.testing.assert_array_equal(whole, pieces)
