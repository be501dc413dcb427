"""The study of the readings of the noise, against the cases' own study, `jointfrf.pollute` and known densities."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from readings.__main__ import main
from readings.printed_values import printed_tables
from readings.ranking import by_table, totals
from readings.reading import Reading, every_reading, noise_numbers, reference_moduli
from readings.score import score
from readings.study import ReadingsPlan, group_cases, study_readings

import jointfrf as jf
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.known_joint.exact import exact_frfs
from jointfrf.workbench.cases.known_joint.regenerate import regenerate_all
from jointfrf.workbench.cases.workers import Workers
from thinned_cases import estimate_realisations

#: Readings that `jointfrf.pollute` knows: kind, relative_to.
POLLUTE = {
    ("complex", "normal", "deviation of modulus"): "complex",
    ("complex", "normal", "deviation"): "complex-per-part",
    ("real", "normal", "deviation"): "real-normal",
    ("real", "uniform", "bound"): "real-uniform",
    ("real", "uniform", "deviation"): "real-uniform-std",
}
#: The first noise of case 3.2.
AS_IN_CASE = Reading("real", "uniform", "deviation", "FRF", False, "value")
RELATIVE = {"value": "entry", "line": "line", "spectrum": "spectrum"}


@pytest.fixture(scope="module")
def beams():
    """Case 3.2 on fewer lines."""
    case = read_case(find_case("3.2"))
    return replace(case, freq_hz=np.arange(15.0, 900.0, 8.0))


def frfs():
    rng = np.random.default_rng(1)
    return rng.normal(size=(6, 4, 4)) + 1j * rng.normal(size=(6, 4, 4))


def polluted(reading, h, level, seed, count=2):
    draw = reading.draw(2, 4, mirrored=True)
    numbers = noise_numbers(draw, h.shape, seed, 0, count)
    return reading.scale(level).pollute(h, reference_moduli(h, reading.reference), numbers)


def test_readings_that_pollute_knows_are_its_own():
    h, compared = frfs(), 0
    blocks = {"FRF": 1, "2 x 2": 2, "block": 2, "line": 4}
    for reading in every_reading():
        kind = POLLUTE.get((reading.parts, reading.law, reading.level_means))
        if kind is None or reading.reference not in RELATIVE:
            continue
        expected = jf.realisations(
            h, 0.05, kind, 3, relative_to=RELATIVE[reading.reference], reciprocal=reading.reciprocal,
            block=blocks[reading.sharing], count=2,
        )  # fmt: skip
        np.testing.assert_allclose(polluted(reading, h, 0.05, 3), expected, rtol=1e-13)
        compared += 1
    assert compared == 5 * 7 * 3


@pytest.mark.parametrize(
    ("meaning", "deviation", "bound"), [("deviation", 0.05, 0.05 * 3**0.5), ("bound", 0.05 / 3**0.5, 0.05)]
)
def test_complex_uniform_numbers_have_the_deviation_or_the_bound(meaning, deviation, bound):
    h = np.ones((20000, 1, 1), complex)
    reading = Reading("complex", "uniform", meaning, "FRF", False, "value")
    numbers = noise_numbers(reading.draw(1, 1, mirrored=True), h.shape, 5, 0, 1)
    added = reading.scale(0.05).pollute(h, None, numbers)[0, :, 0, 0] - 1
    for part in (added.real, added.imag):
        assert part.std() == pytest.approx(deviation, rel=0.02)
        assert 0.999 * bound < abs(part).max() <= bound * (1 + 1e-12)
    assert abs(np.corrcoef(added.real, added.imag)[0, 1]) < 0.03


def test_re_and_im_apart_each_change_by_their_own_factor():
    h = frfs()
    found = polluted(Reading("Re and Im apart", "uniform", "bound", "block", True, "value"), h, 0.05, 7)[0]
    re, im = found.real / h.real - 1, found.imag / h.imag - 1
    assert 0 < abs(re).max() <= 0.05 * (1 + 1e-12)
    assert abs(re - im).max() > 0.01
    for part in (re, im):
        np.testing.assert_allclose(part[:, :2, 2:], np.broadcast_to(part[:, :1, 2:3], (6, 2, 2)), atol=1e-12)
        np.testing.assert_allclose(part[:, :2, 2:], part[:, 2:, :2], atol=1e-12)


def test_own_spectrum_is_the_largest_of_each_frf_over_the_lines():
    h = frfs()
    moduli = reference_moduli(h, "own spectrum")
    assert moduli.shape == (1, 4, 4)
    assert moduli[0, 2, 3] == pytest.approx(max(abs(one[2, 3]) for one in h), rel=1e-15)


def test_density_is_that_of_a_normal_distribution():
    rng = np.random.default_rng(2)
    z = rng.normal(0.5, 0.2, 20000)
    for at in (0.1, 0.5, 0.9):
        expected = -0.5 * ((at - 0.5) / 0.2) ** 2 - np.log(0.2 * np.sqrt(2 * np.pi))
        assert score(3 * np.sinh(z), 3 * np.sinh(at), 3.0, 0.0).log_density == pytest.approx(expected, abs=0.05)


def test_a_value_amid_the_realisations_is_likelier_than_one_far_away():
    values = np.linspace(0.9, 1.1, 101)
    near, far = score(values, 1.0, 1.0, 0.0), score(values, 50.0, 1.0, 0.0)
    assert near.inside
    assert not far.inside
    assert near.log_density > far.log_density > -9


def test_realisations_without_a_value_count_as_not_explaining():
    values = np.linspace(0.9, 1.1, 100)
    some, few = values.copy(), values.copy()
    some[::3], few[::5], few[1::2] = np.nan, np.nan, np.nan
    whole = score(values, 1.05, 1.0, 0.0)
    assert score(some, 1.05, 1.0, 0.0).inside
    assert score(some, 1.05, 1.0, 0.0).log_density < whole.log_density
    assert not score(few, 1.05, 1.0, 0.0).inside
    nothing = score(np.full(100, np.nan), 1.05, 1.0, 0.0)
    assert nothing.log_density == pytest.approx(np.log(1 / np.pi / (1 + np.arcsinh(1.05) ** 2) / 101))


def test_a_reading_gives_the_distribution_of_the_case(beams):
    """The noise of the case is one of the readings; same seed, so the same realisations."""
    beams = replace(beams, seed=5)
    (group,) = group_cases([beams])
    explained = study_readings(group, ReadingsPlan((8.0,), count=40, seed=5, readings=(AS_IN_CASE,)))
    (own,) = explained
    theta = next(
        one for one in estimate_realisations(beams, exact_frfs(beams), 40) if (one.noise, one.method) == ("5 %", "ismm")
    ).theta
    expected = np.percentile(theta, [50, 2.5, 97.5], axis=0).T
    np.testing.assert_allclose([(s.median, s.low, s.high) for s in own.scores], expected, rtol=1e-8)


def test_errors_of_regenerated_frfs_are_those_of_the_case(beams, tmp_path):
    """Table of errors in a case of two DOFs, where the study of cases computes them by all lines of the case."""
    folder = find_case("3.2")
    text = (folder / "case.toml").read_text()
    observed = '[[observed]]\npoint = "s"\ndof = "Fy"\nbands = [[60.0, 200.0]]\n\n'
    text = text.replace("[[bands]]", observed + "[[bands]]", 1).replace("step = 5.0", "step = 8.0")
    (tmp_path / "case.toml").write_text(text)
    published = '[[regenerated]]\nsource = "a table"\nnoise = "5 %"\nmethod = "ismm"\nobserved = "s-Fy"\n'
    published += "band = [[60.0, 200.0]]\namplitude = 3.0\nfrequency = 0.0\n"
    (tmp_path / "expected.toml").write_text(published)
    case = read_case(tmp_path)
    (group,) = group_cases([case])
    explained = study_readings(group, ReadingsPlan((8.0,), count=30, seed=case.seed, readings=(AS_IN_CASE,)))
    (own,) = explained
    exact = exact_frfs(case)
    identified = [one for one in estimate_realisations(case, exact, 30) if (one.noise, one.method) == ("5 %", "ismm")]
    (frf,) = regenerate_all(exact, identified, case.observed, Workers())
    for found, expected in zip(own.scores, (frf.amplitude[0], frf.frequency[0]), strict=True):
        good = expected[np.isfinite(expected)]
        assert good.size >= 15
        assert found.median == pytest.approx(np.median(good), rel=1e-6)
        np.testing.assert_allclose((found.low, found.high), np.percentile(good, [2.5, 97.5]), rtol=1e-6)


def test_same_printed_numbers_count_once_by_the_better_way(beams):
    (group,) = group_cases([beams])
    assert [len(table.values) for table in group.tables] == [4]  # the two noises of the case print the same table
    twice = replace(group, tables=(group.tables[0], replace(group.tables[0], way="another way")))
    explained = study_readings(twice, ReadingsPlan((50.0,), (1.0, 0.1), count=10))
    every = totals(explained, [50.0])
    assert {total.count for total in every} == {4}
    assert len(every) == 2 * len(list(every_reading()))
    densities = [total.log_density for total in every]
    assert densities == sorted(densities, reverse=True)
    assert all(len({one.scores for one in own}) > 10 for own in by_table(explained).values())


def test_levels_of_a_table_are_those_of_its_noise():
    tables = printed_tables([read_case(find_case("3.3"))])
    assert (
        sorted((table.source, table.level) for table in tables) == [("table 3-4", 0.05)] * 2 + [("table 3-4", 0.1)] * 2
    )


def test_command_prints_the_ranking_and_writes_every_reading(tmp_path, capsys):
    words = ["3.2", "--spacing", "25,50", "--realisations", "12", "--workers", "1", "--top", "2"]
    main([*words, "--out", str(tmp_path)])
    printed = capsys.readouterr().out
    assert printed.count("ismm, 200-900 / 15-200 Hz") == 2
    with (tmp_path / "altogether.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * len(list(every_reading()))
    assert {row["of"] for row in rows} == {"4"}
    with (tmp_path / "values.csv").open() as file:
        values = list(csv.DictReader(file))
    by_reading = {}
    reading = [
        column for column in rows[0] if column in values[0] and column not in ("lines, Hz", "level", "log density")
    ]
    assert len(reading) == 6
    for row in values:
        key = tuple(row[column] for column in (*reading, "lines, Hz", "level"))
        by_reading[key] = by_reading.get(key, 0) + (row["verdict"] == "inside")
    best = rows[0]
    # a range of fewer than 100 lines keeps its own spacing
    assert by_reading[(*(best[column] for column in reading), "5", "1")] == int(best["inside"])
    main(words)
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["4.3.3"], "4.3.3-bolt is not a case of a known joint"),
        (["3.3.1"], "names no values of a method with band means"),
        (["3.9"], "unknown case '3.9'"),
        (["3.2", "--spacing", "1,0"], "must be positive numbers, separated by commas, not '1,0'"),
        (["3.2", "--level", "x"], "must be positive numbers, separated by commas, not 'x'"),
    ],
)
def test_wrong_words_are_named(words, sentence, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(words)
    assert sentence in capsys.readouterr().err
