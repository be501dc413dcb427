"""What is wrong in a case file is told in one sentence with file and key."""

import pytest

from jointfrf.case_file import read_case
from jointfrf.cases import find_case
from jointfrf.errors import FileContentError

CHANGES = [
    ('title = "Two masses', 'titel = "Two masses', r"the key 'title' is missing"),
    ("seed = 31", "seed = 31\nsede = 1", r"\[study\]: unknown key 'sede'; it takes realisations, seed"),
    ("seed = 31", "", r"\[study\]: the key 'seed' is missing"),
    ("seed = 31", 'seed = "x"', r"\[study\]: seed must be a whole number, at least 0, not 'x'"),
    ("seed = 31", "seed = true", r"seed must be a whole number"),
    ("realisations = 1000", "realisations = 0", r"realisations must be a whole number, at least 1, not 0"),
    ("level = 0.05", 'level = "5 %"', r"\[\[noise\]\] number 1: level must be a number, at least 0, not '5 %'"),
    ("level = 0.05", "level = nan", r"level must be a number"),
    ("level = 0.05", "", r"the key 'level' is missing"),
    ('kind = "complex"', 'kind = "white"', r"kind must be one of complex, .*, not 'white'"),
    ("block = 1", "block = 2", r"block must be a divisor of 1"),
    ('["ismm", "compliance"]', '["ismn"]', r"methods must be a list of compliance, ismm, .*, not \['ismn'\]"),
    ('["ismm", "compliance"]', "[]", r"methods must be a list"),
    ("reciprocal = false", 'reciprocal = "no"', r"reciprocal must be true or false, not 'no'"),
    (
        "k_x = [[3.0, 9.0]]",
        "k_x = [[11.0, 12.0]]",
        r"\[\[bands\]\] number 1: k_x: .*11 to 12 Hz holds no frequency line",
    ),
    ("k_x = [[3.0, 9.0]]", "k_x = [3.0, 9.0]", r"k_x must be a list of bands \[low, high\] in Hz"),
    ("k_x = [[3.0, 9.0]]", "k_x = [[9.0, 3.0]]", r"k_x must be a list of bands"),
    ("k_x = [[3.0, 9.0]]", "", r"the key 'k_x' is missing"),
    ("c_x = [[3.0, 9.0]]", "c_x = [[3.0, 9.0]]\nk_y = [[3.0, 9.0]]", r"unknown key 'k_y'"),
    ("step = 0.01", "step = 0", r"\[frequency\]: step must be positive"),
    ("step = 0.01", "step = 1e-9", r"step must be larger"),
    ("first = 0.01", "first = 0", r"first must be above 0 Hz"),
    ("last = 10.0", "last = 0.001", r"last must be at least 0.01 Hz"),
    ('j = ["2:x"]', 'j = ["9:x"]', r"\[points\]: the model has no DOF '9:x'"),
    ('j = ["2:x"]', 'j = ["2:x", "1:x"]', r"\[points\]: j must be a list of 1 DOFs"),
    ("masses = [5.0, 3.0]", "masses = [5.0, -3.0]", r"\[substructure_a\]: masses must name .* positive"),
    ("stiffness = [2500.0, 3500.0]", "stiffness = [2500.0]", r"\[substructure_a\]: stiffness must have shape"),
    ('ground = "start"', 'ground = "left"', r"\[substructure_a\]: ground must be one of"),
    (
        'motion = "translation"',
        'motion = "sideways"',
        r"\[\[joint\]\] number 1: motion must be one of translation, rotation",
    ),
    ("damping = 3.0", "damping = -3.0", r"damping must be a number, at least 0, not -3.0"),
    ('model = "chain"', 'model = "plate"', r"model must be one of beam, chain, not 'plate'"),
    ("[study]", "[study", r"not a TOML file"),
]


@pytest.mark.parametrize(("old", "new", "message"), CHANGES)
def test_one_sentence_names_file_and_key(tmp_path, old, new, message):
    text = (find_case("3.1") / "case.toml").read_text()
    assert old in text
    (tmp_path / "case.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(FileContentError, match=message) as error:
        read_case(tmp_path)
    sentence = str(error.value)
    assert sentence.startswith(str(tmp_path / "case.toml"))
    assert "\n" not in sentence


def test_expected_numbers_must_belong_to_the_case(tmp_path):
    for name in ("case.toml", "expected.toml"):
        (tmp_path / name).write_text((find_case("3.1") / name).read_text())
    path = tmp_path / "expected.toml"
    path.write_text(path.read_text().replace('noise = "5 %"', 'noise = "6 %"'))
    with pytest.raises(FileContentError, match=r"expected\.toml.*noise must be one of 5 %, not '6 %'"):
        read_case(tmp_path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileContentError, match=r"case\.toml: cannot be read: No such file"):
        read_case(tmp_path)


def test_frequency_lines_are_those_written():
    freq = read_case(find_case("3.1")).freq_hz
    assert (freq.size, freq[0], freq[299], freq[-1]) == (1000, 0.01, 3.0, 10.0)
