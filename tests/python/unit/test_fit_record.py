"""A fit kept as numbers and text: nothing of it changes, and what is no such thing is said in one sentence."""

import json

import numpy as np
import pytest

import jointfrf as jf

PROBABILITIES = (0.5, 0.6827, 0.9, 0.95, 0.99)


@pytest.fixture(scope="module")
def fits(beams):
    """One of each kind: open intervals of a stiff joint, cross terms, hysteresis, laws, an assembly, band means."""
    stiff = jf.Joint([1e12, 5e3], [0, 1.5], ["y", "theta"])
    coupled = jf.Joint([[6e5, 1e4], [1e4, 5e3]], [20, 1.5], ["y", "theta"])
    gamma = jf.pollute(beams.gamma(beams.joint), 0.01, seed=1)
    with pytest.warns(jf.IdentificationWarning):
        open_above = jf.identify(beams.freq, jf.pollute(beams.gamma(stiff), 0.01, seed=2), ["y", "theta"])
    mount = jf.LawJoint({"y": jf.SpringLaw(6e5, c=20.0), "theta": jf.StandardLinearSolid(5e3, 8e3, 1e-3)})
    of_laws = jf.couple(beams.h_a, beams.h_b, mount, beams.at, beams.at, freq_hz=beams.freq)
    dofs = beams.at + [2 * beams.n + i for i in beams.at]
    lossy = jf.Joint([6e5, 5e3], dofs=["y", "theta"], loss_factor=[0.05, 0.1])
    part = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"],
                           {"youngs_modulus": jf.Unknown(1.0, 0.02)}, exact=True)  # fmt: skip
    whole = jf.Assembly(part, jf.Substructure(jf.chain([4], [2000], [2], ground="end"), ["1:x"], exact=True),
                        jf.LawJoint({"x": jf.SpringLaw(2000.0, h=100.0)}))  # fmt: skip
    freq = np.linspace(0.5, 10, 200)
    at = ["A/1:x"]
    return {
        "hysteretic": jf.identify(beams.freq, jf.pollute(beams.gamma(lossy), 0.01, seed=3), ["y", "theta"]),
        "laws": jf.identify(beams.freq, jf.pollute(of_laws[:, dofs][:, :, dofs], 0.01, seed=4), joint=mount),
        "model": jf.identify_model(freq, jf.pollute(whole.receptance(freq, at, at), 0.02, seed=5), whole, at, at),
        "open": open_above,
        "cross": jf.identify(beams.freq, jf.pollute(beams.gamma(coupled), 5e-3, seed=1), ["y", "theta"], cross="fit"),
        "mean": jf.identify_band_mean(beams.freq, gamma, "inverse-substructuring", ["y", "theta"], (200.0, 800.0)),
        "one line": jf.identify_band_mean(beams.freq, gamma, "inverse-substructuring", ["y", "theta"], (200.0, 200.0)),
    }


@pytest.mark.parametrize("kind", ["open", "cross", "hysteretic", "laws", "model", "mean", "one line"])
def test_a_fit_comes_back_as_it_was(fits, kind, tmp_path):
    fit = fits[kind]
    path = jf.save(fit, tmp_path / "joint.json", lines=True)
    same = jf.load(str(path))
    assert json.loads(path.read_text()) == jf.fit_to_dict(fit) == jf.fit_to_dict(same)
    assert str(same) == str(fit)
    assert [p.name for p in tmp_path.iterdir()] == ["joint.json"]
    np.testing.assert_array_equal(same.freq_hz, fit.freq_hz)
    np.testing.assert_array_equal(same.k_lines, fit.k_lines)
    assert same.parameters == fit.parameters
    assert same.findings == fit.findings
    np.testing.assert_array_equal(same.covariance, fit.covariance)
    np.testing.assert_array_equal(same.k_joint([3.0, 70.0]), fit.k_joint([3.0, 70.0]))
    for probability in PROBABILITIES:
        np.testing.assert_equal(same.confidence_interval(probability), fit.confidence_interval(probability))


def test_a_loaded_fit_goes_on(fits, beams, tmp_path):
    fit = jf.load(jf.save(fits["cross"], tmp_path / "joint.json"))
    assembly = jf.couple(beams.h_a, beams.h_b, fit.k_joint(beams.freq), beams.at, beams.at)
    np.testing.assert_array_equal(assembly, beams.coupled(fits["cross"].joint))
    gamma = jf.pollute(beams.gamma(beams.joint), 0.01, seed=1)
    named = jf.identify(beams.freq, gamma, ["y", "theta_z"], noise=0.01)
    again = jf.fit_from_dict(jf.fit_to_dict(named))
    assert jf.cards(again, "nastran", (1, 2)) == jf.cards(named, "nastran", (1, 2))


def test_a_loaded_fit_says_which_intervals_it_has(fits):
    fit = fits["open"]
    with pytest.raises(ValueError, match=r"0\.8: this fit was loaded.* at 0\.5, 0\.6827, 0\.9, 0\.95"):
        jf.fit_from_dict(jf.fit_to_dict(fit)).confidence_interval(0.8)
    more = jf.fit_from_dict(jf.fit_to_dict(fit, probabilities=[0.8]))
    assert more.confidence_interval(0.8) == fit.confidence_interval(0.8)
    assert jf.fit_to_dict(more) == jf.fit_to_dict(fit, probabilities=[0.8])
    # Those of means over bands follow from their standard errors.
    mean = jf.fit_from_dict(jf.fit_to_dict(fits["mean"]))
    assert mean.confidence_interval(0.8) == fits["mean"].confidence_interval(0.8)


def test_without_its_lines_as_it_is_saved_a_fit_is_short(fits, tmp_path):
    fit = fits["cross"]
    short = json.loads(jf.save(fit, tmp_path / "joint.json").read_text())
    assert short == jf.fit_to_dict(fit, lines=False)
    assert len(json.dumps(short)) < 0.2 * len(json.dumps(jf.fit_to_dict(fit)))
    same = jf.fit_from_dict(short)
    assert str(same) == str(fit)
    assert same.k_lines is None


def test_lines_at_any_distance_are_kept(fits):
    freq = np.array([1.0, 2.0, 4.0, 4.0000000001])
    cut = {"lines_hz": freq.tolist(), "k_lines": {part: [1.0] * 16 for part in ("real", "imag")}}
    fit = jf.fit_from_dict(jf.fit_to_dict(fits["cross"]) | cut)
    np.testing.assert_array_equal(jf.fit_from_dict(jf.fit_to_dict(fit)).freq_hz, freq)


def test_a_later_version_is_one_sentence(fits, tmp_path):
    path = tmp_path / "joint.json"
    path.write_text(json.dumps(jf.fit_to_dict(fits["mean"]) | {"format_version": 3, "written_by": "jointfrf 9.1.0"}))
    with pytest.raises(jf.FileContentError, match=r"version 3, written by jointfrf 9\.1\.0; .*reads versions up to 2"):
        jf.load(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1, 2]", 'its "format" is not "jointfrf joint"'),
        ('{"format": "other"}', 'its "format" is not "jointfrf joint"'),
        ("-1\n    -1\n    58", "it is not JSON"),
        (b"\x00\xff\xfe", "it is not JSON"),
        ("[" * 100_000, "it is not JSON"),
        ('{"format_version": ' + "9" * 5000 + "}", "it is not JSON"),
        ('{"format": "jointfrf joint", "format_version": "x"}', '"format_version" must be a whole number'),
    ],
)
def test_another_file_is_one_sentence(text, said, tmp_path):
    path = tmp_path / "other.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(jf.FileContentError, match=said) as caught:
        jf.load(path)
    assert str(path) in str(caught.value)


def test_what_is_missing_or_damaged_is_named(fits):
    content = jf.fit_to_dict(fits["open"])
    fine = [("method", "x"), ("warnings", []), ("notes", []), ("intervals", None), ("k_lines", None)]
    fine += [("residual_is_noise", None), *((key, bad) for key in ("responses", "forces") for bad in ([], None))]
    fine += [
        ("joint", None),
        ("derived", None),
        ("findings", None),
        ("derived", {}),
        ("findings", []),
        ("is_converged", None),
        ("bands_hz", {}),
        ("seen", None),
        ("same", None),
        ("same", []),
    ]
    fine += [(level, bad) for level in ("noise_level", "residual_level") for bad in (3, None)]
    derived = {"written_by", "frequency_hz", "n_lines"}
    for key in content.keys() - derived - {"format", "format_version"}:
        for bad in (3, "x", [], {"real": [], "imag": []}, {"a": 1}, None, [[[]]]):
            if (key, bad) in fine:
                continue
            with pytest.raises(jf.FileContentError, match=key):
                jf.fit_from_dict(content | {key: bad})
        if key not in ("k_lines", "seen", "same"):
            with pytest.raises(jf.FileContentError, match=f'"{key}" is missing'):
                jf.fit_from_dict({name: value for name, value in content.items() if name != key})
    for key in derived:
        jf.fit_from_dict({name: value for name, value in content.items() if name != key})


def test_a_printed_fit_fits_a_terminal(fits):
    for fit in fits.values():
        assert max(map(len, str(fit).splitlines())) <= 80


def test_a_fit_that_cannot_be_written_leaves_nothing(fits, tmp_path):
    with pytest.raises(FileNotFoundError):
        jf.save(fits["mean"], tmp_path / "missing" / "joint.json")
    assert list(tmp_path.iterdir()) == []
