"""What is wrong in a case file is one sentence with file and key."""

import re

import pytest

from jointfrf.errors import FileContentError
from jointfrf.workbench.cases.catalogue import find_case, read_case

CHANGES = [
    (
        'title = "Two masses',
        'titel = "Two masses',
        r"unknown key 'titel'; use one of kind, title, .*, noise; did you mean 'title'\?",
    ),
    (
        "seed = 31",
        "seed = 31\nsede = 1",
        r"\[study\]: unknown key 'sede'; use one of realisations, seed, .*; did you mean 'seed'\?$",
    ),
    ("seed = 31", "", r"\[study\]: the key 'seed' is missing"),
    ("seed = 31", 'seed = "x"', r"\[study\]: seed must be a whole number, at least 0, not 'x'"),
    ("seed = 31", "seed = true", r"seed must be a whole number"),
    ("realisations = 1000", "realisations = 0", r"realisations must be a whole number, at least 1, not 0"),
    ("level = 0.05", 'level = "5 %"', r"\[\[noise\]\] number 1: level must be a number, at least 0, not '5 %'"),
    ("level = 0.05", "level = nan", r"level must be a number"),
    (
        "level = 0.05",
        "level = 5",
        r"\[\[noise\]\] number 1: level: 5 is noise of 500 % .*; correct it, or set confirm_level = true$",
    ),
    ("level = 0.05", "level = 0.51\nconfirm_level = false", r"level: 0\.51 is noise of 51 %"),
    ("level = 0.05", "level = 0.51\nconfirm_level = 1", r"confirm_level must be true or false, not 1"),
    ("level = 0.05", "Level = 0.05", r"unknown key 'Level'; use one of name, level, .*; did you mean 'level'\?"),
    ("masses = [5.0", "mass = [5.0", r"\[substructure_a\]: unknown key 'mass'; use one of model, masses, .*'masses'\?"),
    (
        'ground = "start"',
        'ground = "start"\nelements = 2',
        r"\[substructure_a\]: unknown key 'elements'; use one of model",
    ),
    ("[[noise]]", "[[noises]]", r"case\.toml: unknown key 'noises'; .*did you mean 'noise'\?"),
    ("level = 0.05", "", r"the key 'level' is missing"),
    ('kind = "complex"', 'kind = "white"', r"kind must be one of complex, .*, not 'white'"),
    ("block = 1", "block = 2", r"block must be a divisor of 1"),
    ('["ismm", "compliance"]', '["ismn"]', r"methods must be a list of compliance, ismm, .*, not \['ismn'\]"),
    ('["ismm", "compliance"]', "[]", r"methods must be a list"),
    ("reciprocal = false", 'reciprocal = "no"', r"reciprocal must be true or false, not 'no'"),
    (
        "k_x = [[3.0, 9.0]]",
        "k_x = [[11.0, 12.0]]",
        r"\[\[bands\]\] number 1: k_x: .*11 to 12 Hz contains no frequency line",
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
    (
        'motion = "translation"',
        'motion = "rotation"',
        r"\[\[joint\]\] number 1: motion must be 'translation', as the name 'x' states, not 'rotation'",
    ),
    ("damping = 3.0", "damping = -3.0", r"damping must be a number, at least 0, not -3.0"),
    ('model = "chain"', 'model = "shell"', r"model must be one of chain, beam, plate, brick-beam, .*, not 'shell'"),
    ("[study]", "[study", r"not a TOML file"),
]


#: Of bricks, with six DOFs and observed FRFs.
SOLID_CHANGES = [
    ('preset = "seed"', 'preset = "fine"', r"\[substructure_a\]: preset must be one of seed, accurate, not 'fine'"),
    ("origin = [0.0, 0.0, 0.0]", "origin = [0.0, 0.0]", r"\[substructure_a\]: origin must be a list of 3 numbers, not"),
    ("poisson = 0.33", "poisson = 0.5", r"\[substructure_a\]: poisson must"),
    ("position = 0.2875", "position = 0.3", r"\[substructure_a\]: the hole at 300 mm.* leaves the beam"),
    ("patch_radius", "patchradius", r"\[hole\]: unknown key 'patchradius'; use one of .*did you mean 'patch_radius'\?"),
    ("position = 0.2875, ", "", r"\[substructure_a\]: \[hole\]: the key 'position' is missing"),
    ('face = "top"', 'face = "left"', r"\[hole\]: face must be one of top, bottom.*, not 'left'"),
    ("observed = { r = 0.15 }", "observed = { r = 0.5 }", r"\[substructure_a\]: .*r.* 500 mm"),
    ('"r:theta_z"]', '"r:phi"]', r"\[points\]: the model has no DOF 'r:phi'"),
    ('j = ["hole:x", ', 'j = ["r:x", ', r"\[points\]: the model has no DOF 'r:x'"),
    ('point = "s"\ndof = "Fx"', 'point = "j"\ndof = "Fx"', r"\[\[observed\]\] number 1: point must be one of r, s"),
    (
        'point = "s"\ndof = "Fx"',
        'point = "s"\ndof = "x"',
        r"\[\[observed\]\] number 1: dof must be one of Fx, Mtheta_y,",
    ),
    ('point = "s"\ndof = "Fz"', 'point = "s"\ndof = "Fy"', r"two tables \[\[observed\]\] name the same FRF"),
    ("[[30.0, 90.0], ", "[[601.0, 700.0], ", r"\[\[observed\]\] number 1: bands: .*contains no frequency line"),
]


#: Of a bolted lap joint.
BOLTED_CHANGES = [
    ("spacing_x = 0.010", "spacing_x = -0.010", r"\[measurement\]: spacing_x must be a number, above 0, not -0.01"),
    ("spacing_z = 0.010", "spacing_z = 0", r"\[measurement\]: spacing_z must be a number, above 0, not 0"),
    ("spacing_z = 0.010", "", r"\[measurement\]: the key 'spacing_z' is missing"),
    ("spacing_z = 0.010", "spacing_z = 0.010\nspacing_y = 1", r"\[measurement\]: unknown key 'spacing_y'"),
    ("[measurement]", "[measurements]", r"unknown key 'measurements'; .*did you mean 'measurement'\?"),
    (
        "[contact]\nfriction = 0.3",
        "",
        r"case\.toml: the key 'contact' \(a table \[contact\] with friction\) is missing",
    ),
    ("friction = 0.3", "friction = -0.3", r"\[contact\]: friction must be a number, at least 0"),
    ('size = "M8"', 'size = "M7"', r"\[bolt\]: size must be one of M5, M6, M8, M10, M12, not 'M7'"),
    ('"10.9"', '"11.9"', r"\[bolt\]: strength_class must be one of .*10\.9, 12\.9, not '11\.9'"),
    (
        "preload_share = 0.75",
        "preload_share = 0",
        r"\[bolt\]: preload_share must be a number, above 0, at most 1, not 0",
    ),
    ("preload_share = 0.75", "preload_share = 75", r"\[bolt\]: preload_share must be .*, at most 1, not 75"),
    ("head_radius = 0.0065", "head_radius = 0.004", r"\[bolt\]: head_radius \(4 mm\) must exceed shank_radius"),
    ("poisson = 0.33", "poisson = 0.5", r"\[beams\]: poisson must"),
    ('preset = "seed"', 'preset = "fine"', r"\[beams\]: preset must be one of seed, accurate, not 'fine'"),
    ("overlap = 0.025\n", "", r"\[beams\]: the key 'overlap' is missing"),
    ('dof = "x"', 'dof = "y"', r"\[\[joint\]\] number 6: dofs must name 6 different DOFs"),
    ('dof = "z"', 'dof = "Fz"', r"\[\[joint\]\] number 5: dof must be 'z', in the order x, theta_y, y, .*, not 'Fz'"),
    (
        'motion = "rotation"',
        'motion = "translation"',
        r"number 2: motion must be 'rotation', .*'theta_y'.*, not 'translation'",
    ),
    ("k_theta_y = [[200.0, 500.0]]", "", r"\[bands\]: the key 'k_theta_y' is missing"),
    (
        "k_theta_y = [[200.0, 500.0]]",
        "k_theta_y = [[601.0, 700.0]]",
        r"\[bands\]: k_theta_y: .*contains no frequency line",
    ),
    ("block = 1", "block = 4", r"\[\[noise\]\] number 1: block must be a divisor of 6"),
    ('"compliance"]', '"decoupling-ss"]', r"\[\[noise\]\] number 1: methods must be a list of ismm, compliance"),
    ("[study]", "[study]\nrealization = 1", r"\[study\]: unknown key 'realization'; use one of realisations, seed"),
    ('kind = "bolted-lap"', 'kind = "glued"', r"case\.toml: kind must be one of known-joint, .*, not 'glued'"),
]


def check(folder, case, old, new, message):
    text = (find_case(case) / "case.toml").read_text()
    assert old in text
    (folder / "case.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(FileContentError, match=message) as error:
        read_case(folder)
    sentence = str(error.value)
    assert sentence.startswith(str(folder / "case.toml"))
    assert "\n" not in sentence


@pytest.mark.parametrize(("old", "new", "message"), CHANGES)
def test_one_sentence_names_file_and_key(tmp_path, old, new, message):
    check(tmp_path, "3.1", old, new, message)


@pytest.mark.parametrize(("old", "new", "message"), SOLID_CHANGES)
def test_one_sentence_for_bricks(tmp_path, old, new, message):
    check(tmp_path, "4.3.2", old, new, message)


@pytest.mark.parametrize(("old", "new", "message"), BOLTED_CHANGES)
def test_one_sentence_for_a_bolted_joint(tmp_path, old, new, message):
    check(tmp_path, "4.3.3", old, new, message)


def test_dofs_of_a_bolted_joint_in_another_order(tmp_path):
    """Both are translations: only their names tell that they were exchanged."""
    text = (find_case("4.3.3") / "case.toml").read_text()
    text = text.replace('dof = "x"', 'dof = "?"').replace('dof = "y"', 'dof = "x"').replace('dof = "?"', 'dof = "y"')
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(FileContentError, match=r"number 1: dof must be 'x', in the order x, theta_y, y, .*, not 'y'"):
        read_case(tmp_path)
    (tmp_path / "case.toml").write_text(re.sub(r'\[\[joint\]\]\ndof = "theta_z"(.*\n){6}', "", text))
    with pytest.raises(FileContentError, match=r"number 1: dof must be the first of six"):
        read_case(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("band = [[30.0, 90.0]]", "band = [[30.0, 91.0]]", r"number 1: band must be one of the bands .* for s-Fx"),
        ('observed = "s-Fx"', 'observed = "s"', r"number 1: observed must be one of s-Fx, s-Fy, s-Fz, r-Fy, not 's'"),
        (
            'method = "decoupling-ss"',
            'method = "inverse-substructuring"',
            r"number 2: method must be one of",
        ),
        ('bands = "region 1"', 'bands = "region 1"\ncentral_percent = 95', r"number 1: unknown key 'central_percent'"),
        ("step = 0.15", "step = 0", r"\[printed\]: step must be a number, above 0, not 0"),
        ("lines_within = 1", "", r"\[printed\]: the key 'lines_within' is missing"),
        (
            "lines_within = 1",
            "lines = 1",
            r"\[printed\]: unknown key 'lines'; use one of step, amplitude_within_percent, lines_within",
        ),
        ("offset = [0.0, -0.003, 0.0]", "offset = [0.0, -0.003]", r"number 3: offset must be a list of 3 numbers, not"),
        ('modes = "4-32', 'modes = 4 # "', r"\[figures\]: modes must be a text, not 4"),
    ],
)
def test_expected_numbers_of_regenerated_frfs(tmp_path, old, new, message):
    for name in ("case.toml", "expected.toml"):
        (tmp_path / name).write_text((find_case("4.3.2") / name).read_text())
    path = tmp_path / "expected.toml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(FileContentError, match=message) as error:
        read_case(tmp_path)
    assert str(error.value).startswith(str(path))


def test_expected_numbers_must_belong_to_the_case(tmp_path):
    for name in ("case.toml", "expected.toml"):
        (tmp_path / name).write_text((find_case("3.1") / name).read_text())
    path = tmp_path / "expected.toml"
    path.write_text(path.read_text().replace('noise = "5 %"', 'noise = "6 %"'))
    with pytest.raises(
        FileContentError,
        match=r"expected\.toml.*noise must be one of 5 %, 5 % of the largest FRF at that line, not '6 %'",
    ):
        read_case(tmp_path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileContentError, match=r"case\.toml cannot be read: No such file"):
        read_case(tmp_path)


def test_frequency_lines_are_those_written():
    freq = read_case(find_case("3.1")).freq_hz
    assert (freq.size, freq[0], freq[299], freq[-1]) == (1000, 0.01, 3.0, 10.0)
