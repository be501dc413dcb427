"""Joints in TOML files, written and read; what cannot be written or is wrong in one sentence."""

import numpy as np
import pytest

import jointfrf as jf

MOUNT = jf.LawJoint(
    {
        "y": jf.FractionalZener(2e5 / 3, 6e5, 3e-4, 0.7),
        "rx": jf.PowerLaw(60.0, 30.0, 0.5, 80.0),
        "z": jf.StandardLinearSolid(1e5, 2e5, 1e-3),
        "rz": jf.SpringLaw(5e3, c=1.5, h=12.0),
        ("z", "rz"): jf.SpringLaw(-4e3, c=0.1, is_cross=True),
    },
    rigid=["x"],
    mass={"y": 0.1, "x": 0.1},
    dofs=["x", "y", "rx", "z", "rz"],
)
PLAIN = jf.Joint([[6e5, -20 / 3], [-20 / 3, 5e3]], [20, 1.5], ["y", "theta"], [0.1, 0.0], [0.0, 3.0])


def test_a_joint_of_laws_is_read_as_it_was_written(tmp_path):
    assert jf.read_joint(jf.write_joint(tmp_path / "mount.toml", MOUNT)) == MOUNT


def test_a_joint_of_constants_is_read_as_it_was_written(tmp_path):
    same = jf.read_joint(jf.write_joint(tmp_path / "joint.toml", PLAIN))
    assert same.dofs == PLAIN.dofs
    for name in ("stiffness", "damping", "loss_factor", "structural_damping"):
        assert np.array_equal(getattr(same, name), getattr(PLAIN, name))


def test_a_saved_fit_gives_its_joint(tmp_path):
    freq = np.linspace(0.5, 10, 100)
    a = jf.chain([5], [2500], [3], ground="start").receptance(freq)
    b = jf.chain([4], [2000], [2], ground="end").receptance(freq)
    gamma = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    fit = jf.identify(freq, jf.pollute(gamma, 0.02, seed=1), ["x"])
    assert np.array_equal(jf.read_joint(jf.save(fit, tmp_path / "fit.json")).stiffness, fit.joint.stiffness)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[law]]\ndof = "y"\nlaw = "zener"\n', "law"),
        (
            '[[law]]\ndof = "y"\nlaw = "power"\nvalues = { k = 1, k_a = 1, alpha = 0.5, reference_hz = 9, tau = 2 }\n',
            "the law 'power' takes k, k_a, alpha",
        ),
        ('[[law]]\ndof = "y"\nlaw = "power"\nvalues = { k = 1.0 }\n', "k_a"),
        ('[[law]]\ndof = "y"\nlaw = "rigid"\nstiff = 2\n', "stiff"),
        ('[[law]]\ndof = "y"\nlaw = "rigid"\n[[law]]\ndof = "y"\nlaw = "rigid"\n', "y has two laws"),
        ('[[law]]\nbetween = ["y"]\nlaw = "spring"\nvalues = { k = 1.0 }\n', "the names of two DOFs"),
        ('[[law]]\ndof = "y"\nlaw = "spring"\nvalues = { k = -1.0 }\n', "k of SpringLaw must lie in 0"),
        ('dofs = ["y"]\n', "stiffness"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(tmp_path, text, message):
    path = tmp_path / "mount.toml"
    path.write_text(text)
    with pytest.raises(jf.FileContentError, match=message) as raised:
        jf.read_joint(path)
    assert "mount.toml" in str(raised.value)


def test_what_cannot_be_written_is_named(tmp_path):
    own = jf.FunctionLaw(
        lambda w, v: v[0] + 0j * w, lambda w, v: np.ones((1, w.size)) + 0j * w, [("k", "stiffness")], [1]
    )
    with pytest.raises(ValueError, match="a FunctionLaw cannot be written to a file"):
        jf.write_joint(tmp_path / "own.toml", jf.LawJoint({"y": own}))
    assert not list(tmp_path.iterdir())
    with pytest.raises(ValueError, match=r"ends in \.toml"):
        jf.write_joint(tmp_path / "joint.json", PLAIN)
    with pytest.raises(TypeError, match="joint must be a Joint or a LawJoint"):
        jf.write_joint(tmp_path / "joint.toml", jf.SpringLaw(1.0))
    with pytest.raises(FileNotFoundError, match="there is no file"):
        jf.read_joint(tmp_path / "nothing.toml")
