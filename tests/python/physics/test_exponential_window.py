"""Exponential windows exp(-sigma t): FRFs at s = i w + sigma give one joint, whatever quantity was measured."""

import re
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.io import Channel, FrfSet, read_frfs, write_frfs

FREQ_HZ = np.arange(10.0, 160.0, 0.5)
ENDS = (Channel(1, "+x"), Channel(2, "+x"))
BLOCKS = Path(__file__).resolve().parents[3] / "cases" / "bending-sides" / "test.uff"
pytestmark = pytest.mark.filterwarnings("ignore::jointfrf.IdentificationWarning")


def measured(quantity, sigma, seed, *, c=30.0, h=0.0, noise=0.002):
    """Two masses, a spring of 1.5e5 N/m and dampers, in closed form."""
    s = (2j * np.pi * FREQ_HZ + sigma)[:, None, None]
    z = s**2 * np.diag([2.0, 3.0]) + (1.5e5 + 1j * h + s * c) * np.array([[1, -1], [-1, 1]])
    frfs = jf.pollute(np.linalg.inv(z) * s ** POWER_OF_I_OMEGA[quantity], noise, seed=seed)
    return FrfSet(FREQ_HZ, ENDS, ENDS, frfs, quantity)


def fitted(frfs, decay):
    receptances = frfs.receptance(decay)
    return jf.identify(receptances.freq_hz, receptances.h, ["x"], window_decay=decay)


@pytest.mark.parametrize("quantity", POWER_OF_I_OMEGA)
def test_every_quantity_gives_the_joint(quantity):
    fits = [fitted(measured(quantity, 4.0, seed), 4.0) for seed in range(5)]
    held = [
        fit.confidence_interval()[name][0] < true < fit.confidence_interval()[name][1]
        for fit in fits
        for name, true in (("k_x", 1.5e5), ("c_x", 30.0))
    ]
    assert sum(held) >= 8
    assert all(not [one for one in fit.findings if one.severity == "warning"] for fit in fits)


def test_the_command_takes_the_decay_to_the_conversion(tmp_path):
    shown = []
    for quantity in POWER_OF_I_OMEGA:
        write_frfs(tmp_path / f"{quantity}.npz", measured(quantity, 4.0, 1))
        words = ["--j", "1", "--k", "2", "--dofs", "x", "--window-decay", "4"]
        result = run_command("identify", tmp_path / f"{quantity}.npz", *words)
        assert result.returncode == 0
        shown.append(result.stdout.partition("method")[2])
    assert shown[0] == shown[1] == shown[2]
    assert "exp(-4 t)" in shown[0]


@pytest.mark.parametrize(("quantity", "power"), [("accelerance", 2), ("mobility", 1)])
@pytest.mark.parametrize("sigma", [1.0, 4.0])
def test_a_window_that_was_not_stated_is_named(quantity, power, sigma):
    (said,) = [one for one in fitted(measured(quantity, sigma, 1), 0.0).findings if one.code == "window-not-stated"]
    assert said.severity == "warning"
    named = re.search(r"window of ([\d.]+) /s \(accelerances\) or ([\d.]+) /s \(mobilities\)", said.text)
    assert float(named[3 - power]) == pytest.approx(sigma, rel=0.3)


@pytest.mark.parametrize(("c", "h"), [(5.0, 3000.0), (30.0, 0.0), (0.0, 6000.0)])
def test_no_window_is_named_without_one(c, h):
    for seed in range(3):
        fit = fitted(measured("accelerance", 0.0, seed, c=c, h=h), 0.0)
        assert "window-not-stated" not in [one.code for one in fit.findings]


def test_a_window_of_a_joint_between_flexible_sides():
    """The stiffness of the joint alone loses sigma c of the joint alone, the one seen sigma c of the one seen."""
    joint = ("--at", "0,0,0", "--j", "101:104", "--k", "201:204", "--dofs", "y,rz", "--damping", "viscous")
    result = run_command("identify", BLOCKS, *joint, "--window-decay", "3")
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    assert "exp(-3 t)" in result.stdout
    assert "between virtual points" in result.stdout


def test_line_at_0_hz_is_kept_under_a_window():
    frfs = FrfSet(np.array([0.0, 1.0]), ENDS, ENDS, np.ones((2, 2, 2)), "accelerance")
    np.testing.assert_allclose(frfs.receptance(2.0).h[:, 0, 0], [1 / 4, 1 / (2 + 2j * np.pi) ** 2])


def test_laws_and_models_of_sides_take_no_window():
    frfs = measured("receptance", 0.0, 1)
    joint = jf.LawJoint({"x": jf.SpringLaw(1e5, c=10.0)})
    with pytest.raises(ValueError, match="window_decay 4 corrects springs and dampers, not laws; leave out joint"):
        jf.identify(FREQ_HZ, frfs.h, joint=joint, window_decay=4.0)


def test_a_window_that_a_universal_file_states_is_said(tmp_path):
    path, with_window = tmp_path / "test.uff", tmp_path / "window.uff"
    write_frfs(path, measured("accelerance", 4.0, 1))
    qualifiers = "\n".join([
        "    -1", "  1858", f"{1:12d}" + f"{0:12d}" * 5, f"{0:6d}{6:6d}" + f"{0:6d}" * 10, f"{0:15.7e}" * 5,
        f"{0:15.7e}" * 4 + f"{4:15.7e}", f"{0:15.7e}" * 5, "X+    X+", "NONE", "    -1", "",
    ])  # fmt: skip
    with_window.write_bytes(path.read_bytes() + qualifiers.encode())
    with pytest.warns(jf.errors.FileContentWarning, match=r"exponential window with damping factor 4: .*dataset"):
        read_frfs(with_window)
