"""The case of a bolted lap joint: where it is measured, what its file may hold, and what a run yields."""

import contextlib
import csv
import dataclasses
import io
import json
import re
import shutil
import warnings
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from msgspec import structs

import jointfrf as jf
from jointfrf.dofs import DIRECTIONS, rigid_motion
from jointfrf.workbench.cases import run as case_run
from jointfrf.workbench.cases.bolted_lap import frfs
from jointfrf.workbench.cases.bolted_lap.contact import ContactLaw
from jointfrf.workbench.cases.bolted_lap.frfs import resonance_errors, resonances
from jointfrf.workbench.cases.bolted_lap.lap import LapDivisions, bolted_lap
from jointfrf.workbench.cases.bolted_lap.preload import preload
from jointfrf.workbench.cases.bolted_lap.results import build_summary, build_tables
from jointfrf.workbench.cases.bolted_lap.routes import DOFS, FivePoints, both_sides, measured_entries
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.run import CaseOutput, run_case
from jointfrf.workbench.cli import run
from jointfrf.workbench.cli.main import main
from jointfrf.workbench.report.draw import draw
from thinned_cases import DrawSome

FOLDER = find_case("4.3.3")
COARSE = LapDivisions(across=4, rings=1, circles=0, head=1, nut=1)
#: Columns of `rigid_motion` in the order of the joint DOFs.
ORDER = [DIRECTIONS.index(dof) for dof in DOFS]
CROSS = FivePoints(np.array([0.001, 0.006, 0.2875]), (0.008, 0.012))


def test_differences_and_virtual_points_are_exact_for_rigid_motions():
    motion = rigid_motion(CROSS.points, CROSS.centre).reshape(15, 6)[:, ORDER]
    np.testing.assert_allclose(CROSS.differences @ motion, np.eye(6), atol=1e-12)
    np.testing.assert_allclose(CROSS.virtual_point.transform @ motion, np.eye(6), atol=1e-12)
    other = FivePoints(np.array([0.0, -0.006, 0.28]), (0.01, 0.01))
    both = np.zeros((30, 12))
    both[:15, :6] = motion
    both[15:, 6:] = rigid_motion(other.points, other.centre).reshape(15, 6)[:, ORDER]
    for transform in both_sides(CROSS, other):
        np.testing.assert_allclose(transform @ both, np.eye(12), atol=1e-12)


def test_points_of_the_cross():
    """Figure 4-40: rp, then 1 and 3 along z, 2 and 4 along x; three channels each."""
    offsets = CROSS.points - CROSS.centre
    np.testing.assert_allclose(offsets[:, 1], 0, atol=1e-15)
    np.testing.assert_allclose(offsets[:, 2], [0, -0.012, 0, 0.012, 0], atol=1e-15)
    np.testing.assert_allclose(offsets[:, 0], [0, 0, -0.008, 0, 0.008], atol=1e-15)
    places, directions = CROSS.channels
    np.testing.assert_array_equal(places[::3], CROSS.points)
    np.testing.assert_array_equal(directions[6:9], np.eye(3))


@pytest.mark.parametrize(("points", "dofs"), [((1, 0, 3), ["x", "theta_y", "y", "theta_x"]), ((2, 0, 4), ["theta_z"])])
def test_differences_have_the_signs_of_interface(points, dofs):
    nodes = [point + 1 for point in points]
    places = dict(enumerate(CROSS.points, 1)) | {n + 10: CROSS.points[n - 1] for n in nodes}
    sides = jf.interface(nodes, [n + 10 for n in nodes], dofs, places)
    wanted = np.zeros((len(dofs), 15))
    for i, channel in enumerate(sides.channels):
        if channel.node <= 5:
            wanted[:, 3 * (channel.node - 1) + "xyz".index(channel.axis)] = sides.transform[: len(dofs), i]
    own = CROSS.differences[[DOFS.index(dof) for dof in dofs]]
    turns = [dof.startswith("theta") for dof in dofs]
    np.testing.assert_allclose(own[turns], wanted[turns], rtol=1e-12)


def test_measured_entries_are_those_of_4_28():
    pattern = """
        1 1 0 0 0 0
        1 1 0 0 0 0
        0 0 1 1 0 1
        0 0 1 1 0 0
        0 0 0 0 1 0
        0 0 1 0 0 1"""
    np.testing.assert_array_equal(measured_entries(), np.array(pattern.split(), int).reshape(6, 6).astype(bool))


def test_measurements_1_to_4_written_out(random_lines):
    """(4.15), (4.22), (4.25) with the matrices (4.14), (4.18); theta_x turns the other way in a right-handed system."""
    h = random_lines(2, 15)
    found = CROSS.differences @ h @ CROSS.differences.T * measured_entries()
    s_x, s_z = CROSS.spacing
    along_z, along_x = (np.array([[0, 2 * s, 0], [-1, 0, 1]]) / (2 * s) for s in (s_z, s_x))
    for dofs, points, axis, t, sign in (
        (("x", "theta_y"), (1, 0, 3), 0, along_z, 1),  # Measurement 1
        (("y", "theta_z"), (2, 0, 4), 1, along_x, 1),  # Measurement 3
        (("y", "theta_x"), (1, 0, 3), 1, along_z, -1),  # Measurement 4
    ):
        at, rows = [3 * point + axis for point in points], [DOFS.index(dof) for dof in dofs]
        signed = np.array([1, sign])[:, None] * t
        estimated = signed @ h[:, np.array(at)[:, None], at] @ signed.T
        np.testing.assert_allclose(found[:, np.array(rows)[:, None], rows], estimated, rtol=1e-12)
    np.testing.assert_allclose(found[:, 4, 4], h[:, 2, 2])
    assert np.count_nonzero(found[0]) == 12


def broken(folder, old, new):
    text = (FOLDER / "case.toml").read_text()
    assert old in text
    (folder / "case.toml").write_text(text.replace(old, new, 1))
    return folder


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("hole_radius = 0.0045", "hole_radius = 0.004", "hole_radius (4 mm) must exceed the shank_radius of the bolt"),
        ("hole_radius = 0.0045", "hole_radius = 0.007", "head_radius (6.5 mm) must exceed hole_radius (7 mm)"),
        ("overlap = 0.025", "overlap = 0.4", "overlap (400 mm) must not exceed the lengths of the beams"),
        ("overlap = 0.025", "overlap = 0.012", "head_radius (6.5 mm) must stay within the overlap"),
    ],
)
def test_an_impossible_joint_is_one_sentence_of_the_command(tmp_path, capsys, old, new, message):
    words = ["run", str(broken(tmp_path, old, new)), "--jobs", "1", "--out", str(tmp_path / "out")]
    assert main(words) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"jointfrf: error: {message}")
    assert error.count("\n") == 1


def test_a_case_of_ones_own(tmp_path):
    shutil.copy(FOLDER / "case.toml", tmp_path)
    case = read_case(tmp_path)
    assert case.expected is None
    assert case.figure_numbers == {}
    assert case.preload == pytest.approx(0.75 * 36.6e-6 * 830e6)  # (4.3), (4.4)
    assert case.joint.dofs == DOFS


@pytest.fixture(scope="module")
def tight():
    """The preloaded joint on the mesh of the case."""
    case = read_case(FOLDER)
    beams = case.beams
    lap = bolted_lap(
        beams.lengths[:2], (beams.height, beams.height), beams.width, beams.overlap, beams.hole_radius, case.bolt,
        materials=(beams.material, beams.material), preset=beams.preset,
    )  # fmt: skip
    return case, preload(lap, case.preload, ContactLaw(friction=case.friction))


@pytest.mark.long
def test_preload_of_the_case(tight):
    _, state = tight
    assert set(state.interfaces) == {"head", "lap", "nut"}
    for one in state.interfaces.values():
        assert one.normal_force == pytest.approx(22784, rel=1e-3)
        assert not one.slipping.any()
        assert one.closed.any()
    assert not state.interfaces["lap"].closed.all()
    assert state.contact_radius == pytest.approx(0.01, abs=0.0015)


@pytest.mark.long
def test_natural_frequencies_of_the_case(tight):
    case, state = tight
    values = state.model().natural_frequencies(7)
    assert case.expected.within_percent == 0.5
    np.testing.assert_allclose(values, [12.79, 59.88, 75.78, 228.0, 342.4, 423.3, 487.8], rtol=0.005)
    assert case.expected.values == (12.79, 59.88, 75.78, 228.0, 342.4, 423.3, 487.8)


class Run(NamedTuple):
    """What the command gave: exit status, words, warnings and errors, and the output of the case."""

    status: int
    said: str
    complained: str
    output: CaseOutput

    @property
    def result(self):
        return self.output.result


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The case by the command, with two realisations, on a coarse mesh and with one picture to save time."""
    outputs = []

    def kept(*arguments, **options):
        outputs.append(run_case(*arguments, **options))
        return outputs[-1]

    options = ["--realisations", "2", "--jobs", "1", "--png", "--out", str(tmp_path_factory.mktemp("bolted"))]
    said, complained = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frfs, "bolted_lap", partial(bolted_lap, divisions=COARSE))
        patch.setattr(run, "run_case", kept)
        patch.setattr(case_run, "draw", DrawSome(frozenset(["pressure-bolt"])))
        with (
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(complained),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore", DeprecationWarning)  # as Python does where a command is started
            status = main(["run", "4.3.3", *options])
    return Run(status, said.getvalue(), complained.getvalue(), outputs[0])


def test_the_command_runs_the_case(ran):
    assert ran.status == 0
    assert re.sub(r"jointfrf: 4\.3\.3-bolt: \d+ s(, \d+ %, about .+ left)?\n", "", ran.complained) == ""  # progress
    assert ran.said.startswith("4.3.3-bolt: Bolted beams")
    for title in ("Preloaded contact", "Identified joint parameters", "Transfer to a beam B of 0.2 m"):
        assert f"\n{title}" in ran.said
    assert str(ran.output.report) in ran.said


def test_forces_of_the_coarse_joint_are_the_preload(ran):
    for one in ran.result.state.interfaces.values():
        assert one.normal_force == pytest.approx(ran.result.case.preload, rel=1e-3)


def nearest_peaks(freq, h, places):
    """The largest value within 15 % of each place."""
    near = [abs(freq - place) <= 0.15 * place for place in places]
    return np.array([freq[inside][abs(h[inside]).argmax()] for inside in near])


@pytest.mark.parametrize(
    ("transferred", "lateral", "bending"), [(False, (60, 342), (13, 76, 228, 423)), (True, (86, 507), (16, 116, 326))]
)
def test_bending_is_regenerated_by_measurements_1_to_4_and_the_lateral_plane_is_not(ran, transferred, lateral, bending):
    result = ran.result
    freq = result.case.freq_hz
    one = next(r for r in result.regenerated if r.found[:2] == ("Measurements 1-4", "band mean"))
    h, actual = (one.transferred, result.transferred) if transferred else (one.h, result.actual)
    errors = []
    for d, places in enumerate((lateral, bending)):
        true = nearest_peaks(freq, actual[:, d], places)
        found = nearest_peaks(freq, h[:, d], true)
        errors.append(((abs(found - true) - 1) / true).max())  # a line more or less does not count
    assert errors[0] > 0.1
    assert errors[1] < 0.05  # 3 % on the mesh of the case


def test_all_entries_give_the_known_joint(ran):
    """Exact FRFs of beams with a known joint, all entries: the joint comes out line by line."""
    case, one = ran.result.case, ran.result.unmeasured[0]
    assert one.name == "all entries"
    actual = np.concatenate([np.diagonal(case.joint.stiffness), np.diagonal(case.joint.damping)])
    np.testing.assert_allclose(one.theta, actual, rtol=1e-6)
    exact = case.joint.dynamic_stiffness(case.freq_hz)
    size = np.sqrt(abs(np.einsum("fii->fi", exact)))
    assert (abs(one.k_lines - exact) / (size[:, :, None] * size[:, None, :])).max() < 1e-6


def test_what_unmeasured_entries_do(ran):
    case = ran.result.case
    actual = np.concatenate([np.diagonal(case.joint.stiffness), np.diagonal(case.joint.damping)])
    ratios = [
        dict(zip([k + d for k in "kc" for d in DOFS], u.theta / actual, strict=True)) for u in ran.result.unmeasured
    ]
    _, no_x, no_z, pattern = ratios
    for name, ratio in pattern.items():
        if name.startswith("k"):
            assert ratio == pytest.approx(1, abs=0.05)
    assert pattern["cz"] == pytest.approx(0.15, abs=0.05)
    assert 0.3 < pattern["cx"] < 0.7
    # The structure is symmetric: x, theta_y, theta_z and y, theta_x, z do not know of each other.
    for dof in ("y", "theta_x", "z"):
        assert (no_x["k" + dof], no_x["c" + dof]) == pytest.approx((1, 1), abs=1e-6)
    for dof in ("x", "theta_y", "theta_z"):
        assert (no_z["k" + dof], no_z["c" + dof]) == pytest.approx((1, 1), abs=1e-6)
    assert abs(no_x["cx"] - 1) > 0.1
    assert abs(no_z["cz"] - 1) > 0.5


def test_unmeasured_entries_are_not_why_the_lateral_plane_fails(ran):
    """From exact FRFs the entries of (4.28) give the resonances; central differences fail with all entries, too."""
    for one in ran.result.unmeasured:
        assert (one.shift < 0.1).all()
    lateral = [i for i, peak in enumerate(ran.result.peaks) if peak.direction == "x"]
    for route in ("Measurements 1-4", "central differences"):
        errors = next(r.errors for r in ran.result.regenerated if r.found[:2] == (route, "band mean"))
        assert errors.frequency[lateral].max() > 10


def test_amplitude_errors_do_not_depend_on_the_lines(ran):
    """The low bending mode, 0.13 Hz wide, on lines ten times closer than those of the case."""
    result, case = ran.result, ran.result.case
    low = next(i for i, peak in enumerate(result.peaks) if peak.direction == "y")
    place = result.peaks[low]
    assert place.freq_hz == pytest.approx(12.8, abs=0.3)
    one = next(r for r in result.regenerated if r.found[:2] == ("central differences", "compliance fit"))
    freq = place.freq_hz * np.linspace(0.97, 1.03, 501)
    fine = frfs.beam_frfs(dataclasses.replace(case, freq_hz=freq), case.beams.lengths[1]).on(freq)
    h = abs(fine.tip(jf.Joint(one.found.theta[:6], one.found.theta[6:]).dynamic_stiffness(freq))[:, 1])
    weights = frfs._tip(result.state.model().mesh) @ result.state.model().expansion
    actual = abs(result.state.model().receptance(freq, weights)[:, 1, 1])
    for found, exact in ((place.amplitude, actual.max()), (place.freq_hz, freq[actual.argmax()])):
        assert found == pytest.approx(exact, rel=1e-3)
    assert one.errors.amplitude[low] == pytest.approx(abs(h.max() / actual.max() - 1) * 100, abs=0.1)
    assert one.errors.frequency[low] == pytest.approx(abs(freq[h.argmax()] / freq[actual.argmax()] - 1) * 100, abs=0.05)


def test_lines_are_close_where_peaks_are(ran):
    case = ran.result.case
    every = frfs._close_lines(case)
    assert np.isin(case.freq_hz, every).all()
    assert (np.diff(every) / every[:-1]).max() <= 0.01 / 8 * (1 + 1e-9)
    assert (np.diff(every) / every[:-1]).min() > 1e-6
    around = frfs._with_lines_around(case, np.array([12.8, 300.0]))
    assert np.isin(case.freq_hz, around).all()
    for place in (12.8, 300.0):
        near = around[abs(around - place) < 0.02 * place]
        assert np.diff(near).max() <= 0.01 / 8 * place * (1 + 1e-9)


def one_mode(freq, place, loss=0.01):
    return 1 / (place**2 * (1 + 1j * loss) - freq**2)


def test_no_peak_up_to_the_limit_of_the_search_is_said(ran):
    freq = np.geomspace(50, 150, 2000)
    actual = np.stack([one_mode(freq, 100.0)] * 2, axis=1)
    peaks = resonances(freq, actual)
    assert [(p.direction, round(p.freq_hz, 2)) for p in peaks] == [("x", 100), ("y", 100)]
    near, far = 1.5 * one_mode(freq, 103.0), one_mode(freq, 130.0)
    errors = resonance_errors(freq, peaks, np.stack([near, far], axis=1))
    assert errors.found.tolist() == [True, False]
    assert errors.frequency == pytest.approx([3, 15], abs=0.1)
    assert errors.amplitude[0] == pytest.approx((1.5 / 1.03**2 - 1) * 100, abs=0.1)
    assert np.isnan(errors.amplitude[1])
    tables = {table.key: table for table in ran.output.tables}
    for key, which in (("resonances", "errors"), ("transfer", "transferred_errors")):
        for row, one in zip(tables[key].rows, ran.result.regenerated, strict=True):
            found = getattr(one, which).found
            assert [isinstance(cell, str) and cell.startswith("above ") for cell in row[2::2]] == (~found).tolist()
            assert [cell is None for cell in row[3::2]] == (~found).tolist()
    assert any("above" in str(cell) for row in tables["resonances"].rows for cell in row)


def test_routes_without_noise(ran):
    """Every route ends in lines and in their means over the bands; two of them also in fits."""
    k = ran.result.k_lines
    assert list(k) == ["Measurements 1-4", "central differences", "virtual points", "reference points", "multi-point"]
    for lines in k.values():
        assert lines.shape == (600, 6, 6)
        assert np.isfinite(lines).all()
    found = {r.found[:2]: r.found for r in ran.result.regenerated}
    for route, lines in k.items():
        own = {one.row: bands for one, bands in ran.result.case.bands.bands.items() if one.kind == "k"}
        mean = jf.band_mean(ran.result.case.freq_hz, lines, own, DOFS)
        np.testing.assert_allclose(found[route, "band mean"].theta, np.concatenate(mean))
    fits = [f for f in found.values() if f.estimator == "compliance fit"]
    assert [f.route for f in fits] == ["central differences", "virtual points"]
    assert all((f.std_error > 0).all() for f in fits)


def test_noise(ran):
    result = ran.result
    studies = {(one.route, one.estimator): one for one in result.noisy}
    assert {one.noise for one in result.noisy} == {"1 %"}
    quiet = {r.found[:2]: r.found.theta for r in result.regenerated}
    for key, one in studies.items():
        assert one.theta.shape == (2, 12)
        assert one.shift.shape == one.found.shape == (2, len(result.peaks))
        assert (one.theta[0] != one.theta[1]).all(), key
    # Noise of 1 % leaves the translations of the fit, and takes the rotations from the means over bands.
    fit, mean = ("virtual points", "compliance fit"), ("Measurements 1-4", "band mean")
    translations = [DOFS.index(dof) for dof in "xyz"]
    np.testing.assert_allclose(
        studies[fit].theta[:, translations], np.tile(quiet[fit][translations], (2, 1)), rtol=0.25
    )
    rotation = DOFS.index("theta_x")
    assert (abs(studies[mean].theta[:, rotation]) < 0.3 * quiet[mean][rotation]).all()


KEYS = ["contact", "convergence", "natural-frequencies", "identified", "resonances", "transfer", "noise",
        "noise-resonances", "unmeasured"]  # fmt: skip


def test_tables(ran):
    tables = {table.key: table for table in ran.output.tables}
    assert list(tables) == KEYS
    for table in tables.values():
        assert table.rows
        assert {len(row) for row in table.rows} == {len(table.columns)}
        assert len(set(table.columns)) == len(table.columns)
        with (ran.output.report.parent / "tables" / f"{table.key}.csv").open(newline="") as file:
            assert len(list(csv.reader(file))) == len(table.rows) + 1
    assert [row[0] for row in tables["contact"].rows] == ["head", "lap", "nut"]
    assert len(tables["noise"].rows) == 12 * len(ran.result.noisy)
    assert [str(row[0]) for row in tables["identified"].rows] == [f"{letter}_{dof}" for letter in "kc" for dof in DOFS]


def test_natural_frequencies_beside_the_expected(ran):
    case, result = ran.result.case, ran.result

    def table(expected):
        changed = dataclasses.replace(result, case=dataclasses.replace(case, expected=expected))
        tables = build_tables(changed)
        found = next(t for t in tables if t.key == "natural-frequencies")
        return found, build_summary(changed, tables)

    own = result.natural_frequencies
    true = structs.replace(case.expected, values=(*own[:2], 1.006 * own[2], 1.004 * own[3]))
    found, summary = table(true)
    assert found.failing == (2,)
    assert [row[-1] for row in found.rows] == ["fits", "fits", "does not fit", "fits", "", "", ""]
    assert found.rows[2][3] == pytest.approx((1 / 1.006 - 1) * 100)
    assert summary[0].rows == ((found.title, None, None, "3 of 4", "", "does not fit"),)
    found, summary = table(None)
    assert found.failing == ()
    assert [one.key for one in summary] == ["preload", "worst"]


@pytest.mark.long
def test_every_figure_is_drawn(ran):
    assert all(draw(figure).png.startswith(b"\x89PNG\r\n\x1a\n") for figure in ran.output.figures)


def test_figures_of_the_source_are_there(ran):
    figures = {figure.key: figure for figure in ran.output.figures}
    numbers = {figure.number for figure in figures.values()} - {""}
    assert numbers == {f"4-{i}" for i in (13, 14, 15, 56, 57, 58, 59, 62, 63, 64, 65)}
    assert set(ran.result.case.figure_numbers) <= set(figures)
    folder = ran.output.report.parent / "figures"
    assert {path.stem for path in folder.glob("*.svg")} == set(figures)
    assert {path.stem for path in folder.glob("*.png")} == {"pressure-bolt"}  # which alone is drawn
    for key in figures:
        assert len((folder / f"{key}.csv").read_text().splitlines()) > 10
    for key in ("pressure-a", "pressure-b", "pressure-bolt"):
        for panel in figures[key].panels:
            assert panel.surface.faces.shape[1:] == (4, 2)
            assert panel.surface.values.max() > 100  # MPa


def test_numbers_and_report(ran):
    content = json.loads((ran.output.report.parent / "results.json").read_text())
    assert list(content["tables"]) == KEYS
    assert content["realisations"] == 2
    assert content["preload_newton"] == pytest.approx(22783.5)
    assert content["natural_frequencies_hz"] == ran.result.natural_frequencies.tolist()
    text = ran.output.report.read_text(encoding="utf-8")
    for key in KEYS:
        assert f'id="{key}"' in text
    assert text.count('src="data:image/svg+xml,') == len(ran.output.figures)
    assert "2 realisations of each noise level" in text
    assert "strength_class" in text  # the case itself


@pytest.mark.long
def test_a_study_gives_the_realisations_of_the_run(ran, tmp_path):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frfs, "bolted_lap", partial(bolted_lap, divisions=COARSE))
        found = jf.study("4.3.3", tmp_path, 2, jobs=1)
    seen = 0
    for number, group in enumerate(found.groups):
        labels = np.array([column.estimator for column in group.columns])
        values = found.estimates(number)[1]
        for one in ran.result.noisy:
            own = labels == f"{one.estimator}, {one.route}"
            if one.noise == group.noise and own.any():
                np.testing.assert_allclose(values[:, own], one.theta, rtol=1e-6)
                seen += 1
    assert seen == len(ran.result.noisy)


def test_what_a_study_does_not_take_is_said_before_anything_is_computed(tmp_path):
    for design, message in (
        (
            jf.StudyDesign(estimators=["decoupling-rr"]),
            "'decoupling-rr' in a case of kind bolted-lap",
        ),
        (jf.StudyDesign(own_noises={"none": lambda h, seed, number: h}), "use a case of kind known-joint"),
        (jf.StudyDesign(estimators={"mine": lambda freq, h, dofs: h}), "use a case of kind known-joint"),
    ):
        with pytest.raises(ValueError, match=message):
            jf.study("4.3.3", tmp_path, 2, design=design, jobs=1)
