"""Planned tests: what they will know, which sensors and hits are chosen, what is refused, said and written."""

import itertools
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import jointfrf as jf
from jointfrf.identification.information_bound import least_std_errors
from jointfrf.workbench.cli.main import main
from jointfrf.workbench.planning.design import Design, Designer, Prices, criterion_of

FREQ = np.linspace(0.5, 10, 200)
MASSES = ["A/1:x", "A/2:x", "B/1:x", "B/2:x"]
BEAM = {"youngs_modulus": 70e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.005}


def chains(k: float = 2000.0, c: float = 3.0, **unknowns: jf.Unknown) -> jf.Assembly:
    a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"], unknowns, exact=True)
    b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"], exact=True)
    return jf.Assembly(a, b, jf.Joint([k], [c], dofs=["x"]))


def beams(**joint) -> jf.Assembly:
    a = jf.Substructure(jf.beam(0.3, 6, ends=("clamped", "free"), **BEAM), ["7:y", "7:theta"], exact=True)
    b = jf.Substructure(jf.beam(0.2, 5, **BEAM), ["1:y", "1:theta"], exact=True)
    return jf.Assembly(a, b, jf.Joint([1e6, 1e3], [50.0, 0.1], dofs=["y", "theta"]))


def test_errors_are_those_of_differences_of_the_frfs():
    """J = 2 Re(s^H s) / E|e|^2 with slopes s by differences, and a prior on Young's modulus."""

    def frfs(k: float, c: float, modulus: float) -> np.ndarray:
        a = jf.chain([5, 3], [2500 * modulus, 3500 * modulus], [3, 4], ground="start")
        whole = chains(k, c)
        changed = jf.Assembly(jf.Substructure(a, ["2:x"], exact=True), whole.b, whole.joint)
        return changed.receptance(FREQ, MASSES[:2], MASSES[3:])

    at = np.array([2000.0, 3.0, 1.0])
    exact = frfs(*at)
    slopes = []
    for i, step in enumerate(at * 1e-5):
        up, down = (frfs(*(at + sign * step * np.eye(3)[i])) for sign in (1, -1))
        slopes.append((up - down).ravel() / (2 * step))
    variance = ((0.05 * abs(exact)) ** 2 + ((1e-4 / (2 * np.pi * FREQ) ** 2) ** 2)[:, None, None]) / 4
    weighted = np.array(slopes) / np.sqrt(variance.ravel())
    information = 2 * (weighted.conj() @ weighted.T).real + np.diag([0, 0, 0.02**-2])
    found = jf.plan(
        chains(youngs_modulus=jf.Unknown(1.0, 0.02)), FREQ, MASSES[:2], MASSES[3:], noise=0.05, floor=1e-4, averages=4,
        sensors=MASSES[:2], hits=MASSES[3:],
    )  # fmt: skip
    assert_allclose(list(found.proposed.std_error.values()), np.sqrt(np.diag(np.linalg.inv(information))), rtol=1e-4)
    assert list(found.proposed.std_error) == ["k_x", "c_x", "A/youngs_modulus"]
    assert found.proposed.cost == 0


def test_common_means_are_targets():
    """Of n joints that are known well the mean is known to spread / sqrt(n); of ones that are not, to more."""
    body = jf.chain([5, 3, 4, 2], [2500, 3500, 3000], [3, 4, 1], ground="none")
    values = {"fl": 1800.0, "fr": 2000.0, "rl": 2100.0, "rr": 2200.0}
    dofs = [f"m/{i}:x" for i in range(1, 5)]

    def planned(spread: float | None, noise: float = 1e-3) -> jf.MeasurementPlan:
        joints = {
            name: jf.PlacedJoint(jf.Joint([k], [3.0], ["x"]), [dof])
            for (name, k), dof in zip(values.items(), dofs, strict=True)
        }
        alike = {"mounts": jf.Alike(list(values), spread)}
        part = jf.Substructure(body, [dof.partition("/")[2] for dof in dofs], exact=True)
        whole = jf.Assembly.of_parts({"m": part}, joints, alike=alike)
        return jf.plan(whole, FREQ, dofs, dofs, noise=noise, targets=["mounts.k_x"], sensors=dofs, hits=dofs)

    found = planned(0.1)
    assert found.value["mounts.k_x"] == pytest.approx(np.exp(np.log(list(values.values())).mean()))
    assert found.proposed.error == pytest.approx(0.1 / 2, rel=1e-4)
    assert planned(0.1, noise=100.0).proposed.error > 0.1
    with pytest.raises(ValueError, match=r"mounts\.k_x is the mean of joints with unknown spread"):
        planned(None)


def test_fits_scatter_as_predicted():
    whole = chains()
    test = jf.plan(whole, FREQ, MASSES, MASSES, noise=0.05, budget=3).proposed
    exact = whole.receptance(FREQ, test.sensors, test.hits)
    away = []
    for seed in range(40):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # one fit of 80 finds an error of the models by chance
            h = jf.pollute(exact, 0.05, seed=seed)
            fit = jf.identify_model(FREQ, h, whole, test.sensors, test.hits, noise=0.05)
        away += [(fit.value[name] - true) / test.std_error[name] for name, true in (("k_x", 2000), ("c_x", 3))]
    assert 0.75 < np.std(away) < 1.25  # 80 numbers scatter by 8 %: three times that


def default_beams() -> jf.Assembly:
    """Beams whose models may be off, as by default."""
    a = jf.Substructure(jf.beam(0.3, 6, ends=("clamped", "free"), **BEAM), ["7:y", "7:theta"])
    b = jf.Substructure(jf.beam(0.2, 5, **BEAM), ["1:y", "1:theta"])
    return jf.Assembly(a, b, jf.Joint([1e6, 1e3], [50.0, 0.1], dofs=["y", "theta"]))


def test_errors_are_those_that_fits_state_with_errors_of_the_models():
    """At default settings: noise estimated, models that may be off, another joint to start from."""
    whole, freq, noise = default_beams(), np.arange(20.0, 800, 4), jf.StatedNoise(0.02, accelerance=0.02)
    sensors, hits = ["A/3:y", "B/4:y"], ["B/2:y", "A/5:y"]
    planned = jf.plan(whole, freq, sensors, hits, noise=noise, sensors=sensors, hits=hits).proposed
    exact, start = whole.receptance(freq, sensors, hits), jf.Joint([5e5, 2e3], [20.0, 0.3], dofs=["y", "theta"])
    ratios = []
    for seed in range(3):
        parts = np.random.default_rng(seed).standard_normal((2, *exact.shape)) * np.sqrt(
            noise.variance(freq, exact) / 2
        )
        h = exact + parts[0] + 1j * parts[1]
        fit = jf.identify_model(freq, h, jf.Assembly(whole.a, whole.b, start), sensors, hits)
        ratios.append([fit.std_error[name] / planned.std_error[name] for name in ("k_y", "k_theta", "c_y", "c_theta")])
    assert_allclose(np.exp(np.mean(np.log(ratios), axis=0)), 1, rtol=0.25)
    perfect = jf.plan(beams(), freq, sensors, hits, noise=noise, sensors=sensors, hits=hits).proposed
    assert max(planned.std_error[name] / perfect.std_error[name] for name in perfect.std_error) > 1.5


def test_steps_and_additions_have_the_errors_of_tests_that_are_planned_as_they_are():
    whole, freq, nodes = default_beams(), np.arange(20.0, 800, 10), ["A/3:y", "A/6:y", "B/2:y", "B/6:y"]
    found = jf.plan(whole, freq, nodes, nodes, budget=3)
    more = found.additions[0]
    sensors, hits = (
        [*own, more.dof] if more.kind == kind else list(own)
        for kind, own in (("sensor", found.proposed.sensors), ("hit", found.proposed.hits))
    )
    for one, error in (((sensors, hits), more.error), ((nodes, nodes), found.everything.error)):
        same = jf.plan(whole, freq, *one, sensors=one[0], hits=one[1]).proposed
        assert same.error == pytest.approx(error, rel=1e-3)
    assert more.error == min(one.error for one in found.additions)


@pytest.mark.parametrize("criterion", ["A", "D"])
def test_the_choice_is_that_of_all_choices(criterion):
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((6, 5, 4, 3))
    of_frf = np.einsum("oirp,oirq->oipq", rows, rows)
    targets = np.array([0, 2])
    designer = Designer(
        of_frf, 1e-6 * np.eye(3), criterion_of(targets, criterion), Prices(1, 1), Design((), (), np.inf)
    )
    for size, design in zip(range(2, 7), designer.designs(), strict=False):
        n, m = len(design.sensors), len(design.hits)
        assert n + m == size
        every = itertools.product(itertools.combinations(range(6), n), itertools.combinations(range(5), m))
        best = min(float(designer.loss(designer.information(Design(*one, 0.0)))) for one in every)
        assert best - 1e-9 <= design.loss < best + 0.25  # exchange of one at a time ends near the best
        assert design.loss == pytest.approx(float(designer.loss(designer.information(design))))


def test_designs_of_equal_worth_are_taken_in_the_order_of_the_candidates():
    """By reciprocity sensors and hits may be exchanged; rounding, which differs by processor, must not decide."""
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((5, 5, 4, 3))
    of_frf = np.einsum("oirp,oirq->oipq", rows, rows)
    of_frf += of_frf.swapaxes(0, 1)
    found = []
    for seed in range(12):
        rounding = 1 + 1e-9 * np.random.default_rng(seed).standard_normal((5, 5, 1, 1))
        designer = Designer(
            of_frf * rounding, 1e-6 * np.eye(3), criterion_of(np.arange(3), "A"), Prices(1, 1), Design((), (), np.inf)
        )
        designs = list(designer.designs())
        found.append((designs, [designer.ranked(one, designer.additions(one)) for one in designs]))
    assert all(one == found[0] for one in found)
    first = found[0][0][0]
    assert first.sensors <= first.hits


def test_prices_decide_between_sensors_and_hits():
    cheap = jf.plan(chains(), FREQ, MASSES, MASSES, noise=0.05, budget=14, sensor_price=10.0).proposed
    assert len(cheap.sensors) == 1 < len(cheap.hits)
    assert cheap.cost == 10 + len(cheap.hits)


def test_what_is_kept_costs_nothing_and_stays():
    found = jf.plan(chains(), FREQ, MASSES, MASSES, noise=0.05, budget=2, sensors=["A/1:x"], hits=["A/1:x"])
    assert found.steps[0].cost == 0
    assert found.steps[0].sensors == found.steps[0].hits == ("A/1:x",)
    assert all("A/1:x" in step.sensors and "A/1:x" in step.hits for step in found.steps)
    assert found.proposed.cost == 2
    errors = [one.error for one in found.additions]
    assert errors == sorted(errors)
    assert max(errors) < found.proposed.error
    assert found.everything.error <= min(errors)


def test_shares_of_lines_frfs_and_priors_are_all_there_is():
    found = jf.plan(beams(), np.arange(10.0, 800, 5), ["A/3:y", "B/4:y"], ["A/3:y", "A/5:y"], budget=4)
    assert len(found.proposed.sensors) == len(found.proposed.hits) == 2
    assert_allclose(found.line_share.sum(axis=1), 1, rtol=1e-4)  # no prior but that of a factor of a thousand
    assert_allclose(found.frf_share.sum(axis=(1, 2)), 1, rtol=1e-4)
    assert (found.line_share >= 0).all()
    low, high = found.bands["k_y"]
    inside = (found.freq_hz >= low) & (found.freq_hz <= high)
    assert found.line_share[0][inside].sum() >= 0.9 * found.line_share[0].sum()
    assert found.line_share[0][inside][1:].sum() < 0.9 * found.line_share[0].sum()


def test_a_plan_for_one_parameter_finds_it_better():
    freq, nodes = np.arange(10.0, 800, 5), [*(f"A/{i}:y" for i in range(2, 8)), *(f"B/{i}:y" for i in range(1, 7))]
    of_all = jf.plan(beams(), freq, nodes, nodes, budget=3)
    of_one = jf.plan(beams(), freq, nodes, nodes, budget=3, targets=["k_theta"])
    assert of_one.proposed.std_error["k_theta"] <= of_all.proposed.std_error["k_theta"]
    assert of_one.targets == ("k_theta",)


def test_masses_of_sensors_move_what_a_fit_would_find():
    whole, mass = chains(), 1e-4
    found = jf.plan(whole, FREQ, MASSES, MASSES, budget=4, sensor_mass=mass)
    test = found.proposed
    loaded = jf.Assembly(whole.a, whole.b, whole.joint, tuple(jf.AddedMass(one, mass) for one in test.sensors))
    h = loaded.receptance(FREQ, test.sensors, test.hits)
    variance = (0.01 * abs(whole.receptance(FREQ, test.sensors, test.hits))) ** 2
    with pytest.warns(jf.IdentificationWarning, match="smooth over frequency"):
        fit = jf.identify_model(FREQ, h, whole, test.sensors, test.hits, noise=variance)
    assert_allclose(found.shift["k_x"], fit.value["k_x"] - 2000, rtol=0.05)
    heavy = jf.plan(whole, FREQ, MASSES, MASSES, budget=4, sensor_mass=0.05)
    assert any("masses of the sensors change k_x" in text for text in heavy.warnings)


def test_blind_places_are_named():
    a = jf.Substructure(jf.beam(0.3, 6, axial=True, ends=("clamped", "free"), **BEAM), ["7:y", "7:theta"], exact=True)
    b = jf.Substructure(jf.beam(0.2, 5, **BEAM), ["1:y", "1:theta"], exact=True)
    whole = jf.Assembly(a, b, jf.Joint([1e6, 1e3], [50.0, 0.1], dofs=["y", "theta"]))
    nodes = ["A/3:x", "A/3:y", "B/3:y"]
    found = jf.plan(whole, np.arange(10.0, 800, 5), nodes, nodes, budget=4)
    assert "A/3:x" not in found.proposed.sensors + found.proposed.hits
    assert [one.about for one in found.findings if one.code == "blind-channels"] == [("A/3:x",), ("A/3:x",)]


def test_what_no_test_shows_is_said():
    stiff = jf.Assembly(chains().a, chains().b, jf.Joint([2000.0], [1e-7], dofs=["x"]))
    found = jf.plan(stiff, FREQ, MASSES, MASSES, noise=0.1, budget=4)
    assert any(text.startswith("c_x stays undetermined") for text in found.warnings)
    assert "warning: c_x stays undetermined" in str(found)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"noise": 0.0}, "noise and floor are both zero"),
        ({"noise": -1.0}, "noise must not be negative, not -1"),
        ({"freq_hz": [0.0, 1.0]}, "freq_hz has no lines or a line at or below 0 Hz"),
        ({"targets": ["k_y"]}, "unknown target 'k_y'"),
        ({"responses": ["C/1:x"]}, "response 'C/1:x': neither A nor B has such a DOF"),
        ({"criterion": "E"}, "unknown criterion 'E'; use A or D"),
        ({"budget": 0.0}, "budget must be positive"),
        ({"sensor_mass": -0.1}, "sensor_mass must not be negative, not -0.1 kg"),
        ({"fixed": ["k_x", "c_x"]}, "all parameters of the joint are fixed"),
        ({"assembly": chains(c=0.0)}, "c_x is 0 in the assembly"),
    ],
)
def test_wrong_plans_are_refused(change, message):
    arguments = {"assembly": chains(), "freq_hz": FREQ, "responses": MASSES, "forces": MASSES} | change
    with pytest.raises(ValueError, match=message):
        jf.plan(**arguments)


def test_frfs_at_the_joint_know_what_the_bound_says():
    whole = beams()
    names = ["A/7:y", "A/7:theta", "B/1:y", "B/1:theta"]
    freq = np.arange(20.0, 600, 2)
    gamma = whole.receptance(freq, names, names)
    joint = jf.Joint([1e6, 1e3], [50.0, 0.1], ["y", "theta"])
    found = jf.plan_joint_frfs(freq, gamma, joint, noise=0.02, averages=4)
    assert_allclose(list(found.std_error.values()), least_std_errors(freq, gamma, (0.01 * abs(gamma)) ** 2), rtol=1e-6)
    assert_allclose(found.line_share.sum(axis=1), 1, rtol=1e-9)
    assert_allclose(found.frf_share.sum(axis=(1, 2)), 1, rtol=1e-9)
    # One per cent more averages of one FRF lower the variance by a hundredth of its share.
    variance = (0.01 * abs(gamma)) ** 2
    variance[:, 0, 2] /= 1.01
    better = least_std_errors(freq, gamma, variance)
    assert_allclose(2 * (1 - better / list(found.std_error.values())), 0.01 * found.frf_share[:, 0, 2], rtol=0.02)


def test_wrong_frfs_at_the_joint_move_a_hysteretic_joint():
    a, b = (
        jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"),
        jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"),
    )
    joint = jf.Joint([2000.0], dofs=["x"], loss_factor=0.1)
    h_a, h_b = a.receptance(FREQ), b.receptance(FREQ)
    gamma = jf.couple(h_a, h_b, joint.dynamic_stiffness(FREQ), [1], [0])[:, 1:3, 1:3]
    found = jf.plan_joint_frfs(FREQ, gamma, joint, noise=0.01, biased=gamma * 1.01)
    assert list(found.value) == ["k_x", "h_x"]
    assert found.value["h_x"] == pytest.approx(200)
    assert_allclose(list(found.shift.values()), [2000 * (1 / 1.01 - 1), 200 * (1 / 1.01 - 1)], rtol=1e-3)
    both = jf.plan_joint_frfs(FREQ, gamma, joint, noise=0.01, biased={"gain": gamma * 1.01, "none": gamma})
    assert both.shifts["gain"] == found.shift
    assert_allclose(list(both.shifts["none"].values()), 0, atol=1e-6)
    assert str(both).splitlines()[0].endswith("shift, gain  shift, none")


def test_differences_find_what_lies_between_their_points(capsys):
    """Over s a beam gives way to a pair of forces by s/(3 E I) in bending and 1/(kappa G A s) in shear."""
    case = str(Path(__file__).resolve().parents[3] / "cases/3.3-beams-1mm/case.toml")
    words = ["plan", case, "--band", "10:300", "--step", "5"]
    assert main([*words, "--spacings", "0.002,0.005", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert list(found["shifts"]) == ["2 mm", "5 mm"]
    inertia, shear = 67e9 * 0.025 * 0.006**3 / 12, 5 / 6 * 67e9 / (2 * 1.33) * 0.025 * 0.006
    for spacing, shift in zip((0.002, 0.005), found["shifts"].values(), strict=True):
        softer = 1 / (1 / 5e3 + 2 * (spacing / (3 * inertia) + 1 / (shear * spacing)))
        assert_allclose(5e3 + shift["k_Mtheta"], softer, rtol=0.1)
    assert main([*words, "--spacings", "0.0005"]) == 1
    assert "no node lies 0.0005 m from 301 along x" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint": jf.Joint([[2.0, 1.0], [1.0, 2.0]])}, "give 4 x 4 FRFs for 2 joint DOFs"),
        ({"freq_hz": [0.0]}, "freq_hz has no lines or a line at or below 0 Hz"),
        ({"gamma": np.zeros((1, 2, 2))}, "an FRF is zero on a line"),
    ],
)
def test_wrong_plans_at_the_joint_are_refused(change, message):
    arguments = {"freq_hz": [1.0], "gamma": np.ones((1, 2, 2)), "joint": jf.Joint([1.0])} | change
    with pytest.raises(ValueError, match=message):
        jf.plan_joint_frfs(**arguments)


@pytest.mark.parametrize("number", [3, pytest.param(8, marks=pytest.mark.long)])
def test_the_interval_of_the_next_assembly_is_as_wide_as_expected(number):
    rng = np.random.default_rng(number)
    widths = []
    for _ in range(60):
        fits = [fit_of(np.exp(rng.normal(0, 0.1) + rng.normal(0, 0.02))) for _ in range(number)]
        own = jf.pool(fits).parameters["k_y"].next_one
        widths.append(np.sqrt(own.high / own.low) - 1)
    assert_allclose(np.median(widths), jf.expected_half_width(number, 0.1, 0.02), rtol=0.3)


def fit_of(k: float):
    from jointfrf.identification.result import Fit

    covariance = np.diag([(0.02 * k) ** 2, 1e-4])
    return Fit.of_springs("compliance", ("y",), {"k_y": k, "c_y": 1.0}, covariance, 0.01, 0.01, np.array([1.0, 2.0]))


def test_how_many_assemblies_are_needed():
    needed = jf.assemblies_needed(0.3, 0.1, 0.02)
    assert jf.expected_half_width(needed, 0.1, 0.02) <= 0.3 < jf.expected_half_width(needed - 1, 0.1, 0.02)
    assert jf.assemblies_needed(0.19, 0.1, 0.02) is None
    assert jf.assemblies_needed(10.0, 0.001, 0.0) == 2
    with pytest.raises(ValueError, match="spread must not be negative"):
        jf.assemblies_needed(0.3, -0.1, 0.02)
    with pytest.raises(ValueError, match="number must be a whole number, at least 2"):
        jf.expected_half_width(1, 0.1, 0.02)


@pytest.fixture
def assembly(tmp_path):
    part = (
        'model = "beam"\nyoungs_modulus = 70e9\ndensity = 2700.0\nwidth = 0.025\nheight = 0.006\nloss_factor = 0.01\n'
    )
    (tmp_path / "assembly.toml").write_text(
        f'[A]\n{part}length = 0.3\nelements = 6\nends = ["clamped", "free"]\njoint = ["7:y", "7:theta"]\n'
        f'[B]\n{part}length = 0.2\nelements = 4\njoint = ["1:y", "1:theta"]\n'
        '[[joint.law]]\ndof = "y"\nlaw = "spring"\nvalues = { k = 1e6, c = 50.0 }\n'
        '[[joint.law]]\ndof = "theta"\nlaw = "spring"\nvalues = { k = 1e3, c = 0.1 }\n'
    )
    return tmp_path / "assembly.toml"


def test_the_command_plans_and_writes_a_page(assembly, capsys):
    page = assembly.with_name("plan.html")
    words = ["--band", "20:800", "--step", "5", "--budget", "4", "--report", str(page), "--json", "--spread", "0.1"]
    words += ["--sensors", "A/@0.15,0,0:y,B/3:y", "--next", "0.3", "--sensor-mass", "0.003"]
    assert main(["plan", str(assembly), *words]) == 0
    content = json.loads(capsys.readouterr().out)
    assert set(content["responses"]) == {"A/4:y", "B/3:y"}
    assert content["steps"][-1]["cost"] == 4
    assert content["assemblies"] == 6
    text = page.read_text()
    assert "Sketch of the assembly" in text
    assert text.count("<h2") >= 4


def test_the_command_plans_frfs_of_a_case(capsys):
    case = next(path for path in (jf_cases() / "3.3-beams-1mm").glob("case.toml"))
    assert main(["plan", str(case), "--band", "20:400", "--step", "2", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert set(content["std_error"]) == set(content["bands"])
    assert main(["plan", str(case), "--band", "20:400", "--step", "2", "--budget", "3"]) == 2
    assert "a case has all FRFs between its joint DOFs" in capsys.readouterr().err


def jf_cases():
    from jointfrf.workbench.cases.catalogue import list_cases

    return list_cases()[0].parent


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "--band and --step are missing"),
        (["--band", "20:800", "--step", "5", "--spread", "0.1"], "only one of --spread and --next is given"),
        (["--band", "20:800", "--step", "5", "--hits", "A/70:y"], "neither A nor B has a DOF 'A/70:y'"),
        (["--band", "20:800", "--step", "5", "--noise", "-1"], "'-1' is no number above zero; give one"),
        (["--band", "20:800", "--step", "5", "--sensors", "A/1:y,,"], "is no list of DOFs"),
        (["--band", "20:800", "--step", "5", "--candidates", "0"], "give at least 1"),
    ],
)
def test_wrong_words_are_refused(assembly, words, message, capsys):
    try:
        status = main(["plan", str(assembly), *words])
    except SystemExit as error:
        status = error.code
    assert status in (1, 2)
    assert message in capsys.readouterr().err


def test_a_law_without_values_is_refused(assembly, capsys):
    assembly.write_text(assembly.read_text().replace("values = { k = 1e6, c = 50.0 }\n", ""))
    assert main(["plan", str(assembly), "--band", "20:800", "--step", "5"]) == 1
    assert "the law of y has no expected values; add values = { k = ..., c = ... }" in capsys.readouterr().err
