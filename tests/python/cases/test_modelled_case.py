"""Cases of kind `modelled-joint`: reading, running, what is wrong with a file."""

import json

import pytest

from jointfrf.errors import FileContentError
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.run import run_case


def small_case(tmp_path, *changes):
    """The rubber mount on fewer lines and one direction less, with changes of its text."""
    text = (find_case("rubber-mount") / "case.toml").read_text()
    text = text.replace("step = 1.0", "step = 4.0")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    folder = tmp_path / "mount"
    folder.mkdir()
    (folder / "case.toml").write_text(text)
    return folder


@pytest.mark.long
def test_a_case_gives_parameters_beside_their_bound(tmp_path):
    output = run_case(small_case(tmp_path), tmp_path / "out", realisations=2)
    parameters, stiffness, residual = output.tables
    assert [row[0] for row in parameters.rows][:3] == ["k_y", "k_a_y", "alpha_y"]
    for name, _, actual, median, *_, rmse, bound, _, _ in parameters.rows:
        assert abs(median / actual - 1) < 0.1, name
        assert rmse < 5 * bound, name
    rises = [row[6] for row in stiffness.rows if row[0] == "y"]
    assert rises == sorted(rises)
    assert residual.rows[0][1] == "2 of 2"
    assert residual.rows[1][1] == "no"
    numbers = json.loads((tmp_path / "out" / "mount" / "results.json").read_text())
    assert numbers["first"]["residual_is_noise"] is True
    assert len(numbers["values"]["k_y"]) == 2
    assert {figure.key for figure in output.figures} == {"stiffness", "frfs"}


def test_laws_of_all_kinds_are_read(tmp_path):
    power = 'law = "power"\nactual = { k = 60.0, k_a = 30.0, alpha = 0.5, reference_hz = 100.0 }  # N m/rad\n'
    start = "start = { k = 10.0, k_a = 10.0, alpha = 0.3, reference_hz = 100.0 }\n"
    for law, names in (
        ('law = "rigid"\n', ()),
        ('law = "spring"\nactual = { k = 50.0, c = 0.1 }\nstart = { k = 10.0, c = 0.1 }\n', ("k_theta", "c_theta")),
        (
            'law = "standard-linear-solid"\nactual = { k = 50.0, k_m = 60.0, tau = 1e-3 }\n'
            "start = { k = 10.0, k_m = 10.0, tau = 1e-3 }\n",
            ("k_theta", "k_m_theta", "tau_theta"),
        ),
    ):
        folder = tmp_path / law[7:12]
        folder.mkdir()
        case = read_case(small_case(folder, (power + start, law)))
        assert [name for name in case.truth.joint.names if name.endswith("theta")] == list(names)


def test_any_positive_number_of_a_beam_may_be_unknown(tmp_path):
    old = 'substructure = "A"\nname = "youngs_modulus"\nvalue = 67e9\nstd_percent = 2.0'
    new = 'substructure = "A"\nname = "loss_factor"\nvalue = 0.01\nstd_percent = 20.0'
    case = read_case(small_case(tmp_path, (old, new)))
    unknown = case.believed.a.unknowns["loss_factor"]
    assert (unknown.value, unknown.std, unknown.lower) == (0.01, pytest.approx(0.002), 0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('law = "power"', 'law = "glue"', r"law must be one of spring, .* not 'glue'"),
        ('"A/5:y", ', '"A/99:y", ', r"responses: responses 'A/99:y': neither A nor B has such a DOF"),
        ("noise = 0.02", "noise = 0.0", r"noise must be a number, above 0"),
        ("alpha = 0.5", "alpha = 1.5", r"alpha of PowerLaw must lie in 0.001 to 1, not 1.5"),
        (
            "alpha = 0.5, reference_hz",
            "tau = 0.5, reference_hz",
            r"tau: the law 'power' takes k, k_a, alpha, reference_hz",
        ),
        ("std_percent = 2.0", "std_percent = 0.0", r"std must be positive"),
        (
            'model = "beam"',
            'model = "receptances"\nfile = "x.uff"',
            r"model must be one of chain, beam, plate, brick-beam, matrices, not .receptances.",
        ),
    ],
)
def test_what_is_wrong_is_one_sentence(tmp_path, old, new, message):
    with pytest.raises(FileContentError, match=message):
        read_case(small_case(tmp_path, (old, new)))
