"""`assembly.toml`: what it gives, what is wrong in it, which channel is which DOF, and pages of the fits it makes."""

import json
import re
import warnings
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import jointfrf as jf
from jointfrf.errors import FileContentError
from jointfrf.io import Channel, FrfSet, write_frfs
from jointfrf.toml.documents import schema_of
from jointfrf.workbench.assembly_file.keys import AssemblyKeys
from jointfrf.workbench.assembly_file.read import read_assembly_file
from jointfrf.workbench.report.fit_page import ReportOptions, fit_document
from jointfrf.workbench.report.fit_words import finding_sentences, is_wide
from jointfrf.workbench.report.sketch import SketchedPart, _moved_parts, _view_along, assembly_sketch

FREQ = np.linspace(0.5, 10, 300)
ASSEMBLY = """
[A]
model = "chain"
masses = [5.0, 3.0]
stiffness = [2500.0, 3500.0]
damping = [3.0, 4.0]
ground = "start"
joint = ["2:x"]
unknown = { youngs_modulus = 0.02 }
exact = true

[B]
model = "chain"
masses = [4.0, 2.0]
stiffness = [2000.0, 2500.0]
damping = [2.0, 1.0]
ground = "end"
joint = ["1:x"]
exact = true

[[joint.law]]
dof = "x"
law = "spring"

[channels]
"11:+x" = "A/1:x"
"22:-x" = "B/2:x"
"""


def truth() -> jf.Assembly:
    a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"])
    b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"])
    return jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))


@pytest.fixture(scope="module")
def frfs() -> FrfSet:
    h = jf.pollute(truth().receptance(FREQ, ["A/1:x", "B/2:x"], ["A/1:x"]), 0.03, seed=2)
    channels = Channel(11, "+x"), Channel(22, "+x"), Channel(33, "+z")
    # Point 22 was measured along +x, and the file says that the DOF points along -x there.
    found = np.concatenate([h[:, :1], -h[:, 1:], h[:, 1:]], axis=1)
    return FrfSet(FREQ, channels, channels[:1], found, source="test.uff")


def written(folder: Path, text: str = ASSEMBLY) -> Path:
    path = folder / "assembly.toml"
    path.write_text(text)
    return path


def test_channels_signs_and_unknowns(tmp_path, frfs):
    measured = jf.measured_assembly(written(tmp_path), frfs)
    assert (measured.responses, measured.forces) == (("A/1:x", "B/2:x"), ("A/1:x",))
    assert measured.channels == ({"A/1:x": "11:+x", "B/2:x": "22:+x"}, {"A/1:x": "11:+x"})
    assert measured.unused == ("33:+z",)
    fit = measured.fit()
    for name, value in {"k_x": 2000.0, "c_x": 3.0, "A/youngs_modulus": 1.0}.items():
        low, high = fit.confidence_interval(0.95)[name]
        assert low < value < high
    prior = {one.name: one.prior for one in fit.parameters}["A/youngs_modulus"]
    assert prior == (1.0, 0.02)
    assert fit.test.is_noise


def test_sensor_and_force_of_one_name_may_differ_in_sign(tmp_path, frfs):
    """A sensor that points against the force at the driving point."""
    expected = jf.measured_assembly(written(tmp_path), frfs)
    h = frfs.h.copy()
    h[:, 0] *= -1
    turned = FrfSet(FREQ, frfs.responses, frfs.excitations, h, source="test.uff")
    for channels in (
        '"11:+x" = { response = "A/1:-x", force = "A/1:x" }\n"22:+x" = "B/2:-x"\n',
        '"11:-x" = { response = "A/1:+x", force = "A/1:-x" }\n"22:-x" = { response = "B/2:x" }\n',
    ):
        text = ASSEMBLY.split('"11:+x"')[0] + channels
        found = jf.measured_assembly(written(tmp_path, text), turned)
        assert (found.responses, found.forces) == (expected.responses, expected.forces)
        np.testing.assert_array_equal(found.h, expected.h)
    only = ASSEMBLY.split('"11:+x"')[0] + '"11:+x" = { force = "A/1:x" }\n"22:-x" = "B/2:x"\n'
    assert jf.measured_assembly(written(tmp_path, only), frfs).responses == ("B/2:x",)


def test_values_at_the_start_do_not_matter(tmp_path, frfs):
    values = 'law = "spring"\nvalues = { k = 3.0, c = 0.1 }'
    one, other = (
        jf.measured_assembly(written(tmp_path, text), frfs).fit()
        for text in (ASSEMBLY, ASSEMBLY.replace('law = "spring"', values))
    )
    np.testing.assert_allclose(one.estimate, other.estimate, rtol=1e-3)


def test_bands(tmp_path, frfs):
    measured = jf.measured_assembly(written(tmp_path), frfs, bands=[(2, 4), (6, 8)])
    assert measured.freq_hz.min() >= 2
    assert measured.freq_hz.max() <= 8
    assert not ((measured.freq_hz > 4) & (measured.freq_hz < 6)).any()


def test_the_same_joint_by_constants_laws_and_files(tmp_path):
    laws = read_assembly_file(written(tmp_path)).joint
    constants = re.sub(r"\[\[joint.law\]\].*?\n\n", '[joint]\ndofs = ["x"]\nstiffness = [7.0]\ndamping = [2.0]\n\n',
                       ASSEMBLY, flags=re.DOTALL)  # fmt: skip
    inline = read_assembly_file(written(tmp_path, constants)).joint
    (tmp_path / "joint.toml").write_text('[[law]]\ndof = "x"\nlaw = "spring"\nvalues = { k = 7.0, c = 2.0 }\n')
    named = 'joint = "joint.toml"\n' + re.sub(r"\[\[joint.law\]\].*?\n\n", "", ASSEMBLY, flags=re.DOTALL)
    assert inline == read_assembly_file(written(tmp_path, named)).joint
    assert laws.names == inline.names == ("k_x", "c_x")


def test_matrices_and_frfs_as_parts_give_what_chains_give(tmp_path, frfs):
    a, b = truth().a.nominal_model, truth().b.nominal_model
    scipy.io.mmwrite(tmp_path / "k.mtx", a.stiffness)
    np.savez(tmp_path / "a.npz", mass=a.mass.toarray(), damping=a.damping.toarray())
    matrices = """[A]
model = "matrices"
stiffness = "k.mtx"
mass = "a.npz"
damping = "a.npz"
dofs = ["1:x", "2:x"]
joint = ["2:x"]
unknown = { youngs_modulus = 0.02 }
exact = true

"""
    channels = Channel(1, "+x"), Channel(2, "+x")
    write_frfs(tmp_path / "b.npz", FrfSet(FREQ, channels, channels, b.receptance(FREQ, [0, 1])))
    receptances = '[B]\nmodel = "receptances"\nfile = "b.npz"\njoint = ["1:x"]\n\n'
    text = re.sub(r"\[A\].*?\n\n", matrices, ASSEMBLY, flags=re.DOTALL)
    text = re.sub(r"\[B\].*?\n\n", receptances, text, flags=re.DOTALL)
    one = jf.measured_assembly(written(tmp_path), frfs).fit()
    other = jf.measured_assembly(written(tmp_path, text), frfs).fit()
    np.testing.assert_allclose(one.estimate, other.estimate, rtol=1e-5)
    noisy = text.replace('file = "b.npz"', 'file = "b.npz"\nnoise = 0.05')
    third = jf.measured_assembly(written(tmp_path, noisy), frfs).fit()
    assert third.std_error["k_x"] > 1.2 * other.std_error["k_x"]


def test_unknown_numbers_of_a_beam_have_their_means(tmp_path):
    beam = """[A]
model = "beam"
length = 0.3
elements = 4
youngs_modulus = 67e9
density = 2700.0
width = 0.025
height = 0.006
joint = ["5:y"]
unknown = { youngs_modulus = { mean = 70e9, std = 1e9 }, %s = 0.01, density = { std = 50.0, lower = 2600.0 } }

"""
    at_freq = np.array([30.0, 60.0])
    for name in ("loss_factor", "height"):
        text = re.sub(r"\[A\].*?\n\n", beam % name, ASSEMBLY, flags=re.DOTALL)
        file = read_assembly_file(written(tmp_path, text))
        part = file.parts(at_freq)["A"]
        if name == "loss_factor":
            with pytest.raises(FileContentError, match="the value is 0 and has no relative"):
                part.substructure(at_freq, [])
            continue
        found = part.substructure(at_freq, [])
        assert found.unknowns["youngs_modulus"] == jf.Unknown(70e9, 1e9, 0.0)
        assert found.unknowns["density"] == jf.Unknown(2700.0, 50.0, 2600.0)
        assert found.unknowns["height"] == jf.Unknown(0.006, 0.006 * 0.01, 0.0)
        section = dict(density=2700.0, width=0.025, height=0.006)
        same = jf.beam(0.3, 4, youngs_modulus=70e9, **section)
        stiffness = same.stiffness.toarray()
        np.testing.assert_allclose(found.model().stiffness.toarray(), stiffness, rtol=1e-9, atol=1e-9 * stiffness.max())


def test_masses_springs_and_gains(tmp_path, frfs):
    more = """
[response_gains]
"B/2:x" = 0.05

[force_gains]
"A/1:x" = { mean = 1.0, std = 0.01 }

[[mass]]
dofs = ["A/1:x"]
mass = 0.2
unknown = 0.5

[[ground]]
dof = "B/2:x"
stiffness = 10.0
unknown = { stiffness = { std = 5.0 } }
"""
    text = ASSEMBLY.replace('law = "spring"', 'law = "spring"\nvalues = { k = 1e3, c = 3.0 }')
    measured = jf.measured_assembly(written(tmp_path, 'fixed = ["c_x"]\n' + text + more), frfs)
    assert measured.assembly.attachments == (
        jf.AddedMass(("A/1:x",), jf.Unknown(0.2, 0.1, 0.0)),
        jf.GroundSpring("B/2:x", jf.Unknown(10.0, 5.0, 0.0), 0.0),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # so many unknowns are not held by three FRFs
        names = [one.name for one in measured.fit().parameters]
    assert names == [
        "k_x", "A/youngs_modulus", "mass A/1:x", "ground stiffness B/2:x", "gain of response B/2:x",
        "gain of force A/1:x",
    ]  # fmt: skip


def test_no_model_is_exact_unless_the_file_says_so(tmp_path, frfs):
    fit = jf.measured_assembly(written(tmp_path, ASSEMBLY.replace("exact = true\n", "")), frfs).fit()
    others = {one.name: (one.unit, one.prior) for one in fit.parameters if one.origin != "joint"}
    assert others == {
        "A/youngs_modulus": ("1", (1.0, 0.02)), "A/density": ("1", (1.0, 0.01)),
        "B/youngs_modulus": ("1", (1.0, 0.03)), "B/density": ("1", (1.0, 0.01)),
    }  # fmt: skip


def test_unknowns_by_words(tmp_path):
    more = '[[ground]]\ndof = "B/2:x"\nstiffness = 10.0\nunknown = ["stiffness"]\n'
    text = ASSEMBLY.replace("{ youngs_modulus = 0.02 }", '["E", "density"]') + more
    file = read_assembly_file(written(tmp_path, text))
    found = file.parts(np.ones(1))["A"].substructure(np.ones(1), [])
    assert found.unknowns == {"youngs_modulus": jf.Unknown(1.0, 0.03, 0.0), "density": jf.Unknown(1.0, 0.01, 0.0)}
    assert file.attachments() == (jf.GroundSpring("B/2:x", jf.Unknown(10.0, 5.0, 0.0)),)
    for words, message in (
        ('["E", "youngs_modulus"]', "youngs_modulus: youngs_modulus is named twice"),
        ('["thickness"]', "K and M contain no thickness"),
        ('["densty"]', "unknown number densty; use one of .*did you mean density"),
    ):
        file = read_assembly_file(written(tmp_path, text.replace('["E", "density"]', words)))
        with pytest.raises(FileContentError, match=r"\[A\]: unknown: " + message):
            file.parts(np.ones(1))["A"].substructure(np.ones(1), [])


def test_length_scale_of_matrices_is_that_of_a_beam(tmp_path):
    def built(s):
        return jf.beam(0.3 * s, 4, youngs_modulus=67e9, density=2700.0, width=0.025 * s, height=0.006 * s)

    model = built(1.0)
    scipy.io.mmwrite(tmp_path / "k.mtx", model.stiffness)
    scipy.io.mmwrite(tmp_path / "m.mtx", model.mass)
    dofs = ", ".join(f'"{dof}"' for dof in model.dofs)
    part = f"""[A]
model = "matrices"
stiffness = "k.mtx"
mass = "m.mtx"
dofs = [{dofs}]
joint = ["5:y"]
unknown = ["length_scale"]

"""
    text = re.sub(r"\[A\].*?\n\n", part, ASSEMBLY, flags=re.DOTALL)
    found = read_assembly_file(written(tmp_path, text)).parts(np.ones(1))["A"].substructure(np.ones(1), [])
    assert found.unknowns == {"length_scale": jf.Unknown(1.0, 0.003, 0.0)}
    changed, wanted = found.model({"length_scale": 1.1, "youngs_modulus": 1.02}), built(1.1)
    for own, expected in ((changed.stiffness, 1.02 * wanted.stiffness), (changed.mass, wanted.mass)):
        np.testing.assert_allclose(
            own.toarray(), expected.toarray(), rtol=1e-9, atol=1e-9 * abs(expected.toarray()).max()
        )


def without(*lines: str) -> str:
    return "".join(line for line in ASSEMBLY.splitlines(keepends=True) if not line.startswith(lines))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (without("masses", "damping"), r"\[A\]: the keys 'masses', 'damping' are missing; .*\[B\]: the keys 'masses', "
         "'damping' are missing"),
        ("", r"the keys 'A' \(a table \[A\] with model\), 'B' \(a table \[B\] with model\), 'joint' are missing"),
        (ASSEMBLY.replace("masses", "mases", 1), r"\[A\]: unknown key 'mases'.*did you mean 'masses'"),
        (
            ASSEMBLY.replace('"22:-x"', '"11:-x"'),
            r'11:-x.*: 11:\+x names this direction, too; name it once, as "11:-x" = { response = "A/1:-z", force',
        ),
        (ASSEMBLY.replace('"A/1:x"', '"A/1:-y"'), "neither A nor B has a DOF 'A/1:y'"),
        (ASSEMBLY.replace('"A/1:x"', '{ sensor = "A/1:x" }'), "must be a text such as A/151:y, or a table"),
        (ASSEMBLY.replace("[channels]", "[chanels]"), "unknown key 'chanels'.*did you mean 'channels'"),
        (ASSEMBLY.replace('"chain"', '"chian"', 1), r"\[A\]: model must be one of chain, beam, plate, brick-beam, "
         "rigid-body, matrices, receptances, modes, not 'chian'"),
        (ASSEMBLY.replace("0.02", "-0.02"), r"\[A\]: unknown must be .* positive .*not {'youngs_modulus': -0.02}"),
        (ASSEMBLY.replace("youngs_modulus", "young"), r"\[A\]: unknown: unknown number young.*loss_factor"),
        (ASSEMBLY.replace('["2:x"]', '["3:x"]'), r"\[A\]: joint: A has no DOF '3:x'"),
        (ASSEMBLY.replace('["2:x"]', '["1:x", "2:x"]'), "2 joint DOFs, the joint 1"),
        (ASSEMBLY.replace('"11:+x" =', '"12:+x" ='), r"12:\+x: unknown channel of test.uff; use one of 11:\+x"),
        (ASSEMBLY.replace('"B/2:x"', '"B/9:x"'), "channels: neither A nor B has a DOF 'B/9:x'"),
        (ASSEMBLY.replace('"22:-x"', '"22-"'), r"\[channels\]: '22-' is no channel"),
        (ASSEMBLY + '"33:+z" = "B/2:x"\n', "22:.x and 33:.z of test.uff are one DOF, B/2:x"),
        (ASSEMBLY.split("[channels]")[0], "no response of test.uff is a DOF of A or B; name them under"),
        (ASSEMBLY.replace('law = "spring"', 'law = "sprung"'), r"\[joint\]: \[\[law\]\] number 1: law must be one of"),
        (ASSEMBLY.replace('dof = "x"', 'dof = "theta"'), "2:x is at the place of theta of the joint"),
        (ASSEMBLY + '[response_gains]\n"A/2:x" = 0.1\n', "A/2:x: unknown channel; use one of A/1:x, B/2:x"),
        (ASSEMBLY + '[[ground]]\ndof = "A/7:x"\nstiffness = 1.0\n', "attachment 'A/7:x': neither A nor B has such"),
        (ASSEMBLY + '[[mass]]\ndofs = ["A/1:x"]\n', r"\[\[mass\]\] number 1: the key 'mass' is missing"),
        ('joint = "none.toml"\n' + re.sub(r"\[\[joint.law\]\].*?\n\n", "", ASSEMBLY, flags=re.DOTALL),
         "joint: .*none.toml does not exist"),
        ("A = 3\n" + ASSEMBLY[ASSEMBLY.index("[B]") :], "A must be a table"),
        ("[A", "not a TOML file"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_sentence(tmp_path, frfs, text, sentence):
    with pytest.raises(FileContentError, match=sentence) as caught:
        jf.measured_assembly(written(tmp_path, text), frfs)
    assert str(caught.value).startswith(str(tmp_path / "assembly.toml"))


def test_joint_dofs_in_another_order_are_refused(tmp_path, frfs):
    beam = """model = "beam"
length = 0.3
elements = 4
youngs_modulus = 67e9
density = 2700.0
width = 0.025
height = 0.006
"""
    laws = '[[joint.law]]\ndof = "{}"\nlaw = "spring"\n' * 2
    text = f'[A]\n{beam}joint = ["5:y", "5:theta"]\n[B]\n{beam}joint = ["1:y", "1:theta"]\n' + laws.format("theta", "y")
    with pytest.raises(
        FileContentError, match="5:y is at the place of theta of the joint; its DOFs are, in this order"
    ):
        jf.measured_assembly(written(tmp_path, text + '[channels]\n"11:+x" = "A/2:y"\n'), frfs)


def test_channels_named_like_dofs_need_no_table(tmp_path, frfs):
    text = ASSEMBLY.split("[channels]")[0]
    names = Channel(1, "+x"), Channel(2, "-x")
    own = FrfSet(FREQ, names, names[:1], frfs.h[:, :2], source="test.uff")
    with pytest.raises(FileContentError, match=r"channel 1:\+x may be A/1:x or B/1:x; name it under \[channels\]"):
        jf.measured_assembly(written(tmp_path, text), own)
    # B by matrices whose nodes have other numbers: then names say enough.
    b = truth().b.nominal_model
    np.savez(tmp_path / "b.npz", stiffness=b.stiffness.toarray(), mass=b.mass.toarray(), damping=b.damping.toarray())
    files = 'stiffness = "b.npz"\nmass = "b.npz"\ndamping = "b.npz"\ndofs = ["101:x", "102:x"]\njoint = ["101:x"]\n\n'
    text = re.sub(r"\[B\].*?\n\n", f'[B]\nmodel = "matrices"\n{files}', text, flags=re.DOTALL)
    own = FrfSet(FREQ, (names[0], Channel(102, "-x")), names[:1], frfs.h[:, :2], source="test.uff")
    measured = jf.measured_assembly(written(tmp_path, text), own)
    assert measured.responses == ("A/1:x", "B/102:x")
    np.testing.assert_array_equal(measured.h[:, 1], -own.h[:, 1])


def test_an_frf_that_was_not_measured(tmp_path, frfs):
    h = frfs.h.copy()
    h[:, 1] = np.nan
    fit = jf.measured_assembly(written(tmp_path), FrfSet(FREQ, frfs.responses, frfs.excitations, h)).fit()
    assert np.isnan(fit.data.residual[:, 1]).all()
    document = fit_document(fit, ReportOptions())
    assert "All 1 FRFs" in str([part for section in document.sections for part in section.parts])


def test_the_page_and_the_plot_of_a_model(tmp_path, frfs):
    fit = jf.measured_assembly(written(tmp_path), frfs).fit()
    document = fit_document(fit, ReportOptions("test.uff"))
    keys = [section.key for section in document.sections]
    assert keys == ["summary", *(["doubts"] if fit.findings else []), "joint", "stiffness", "frfs", "maps", "unknowns",
                    *(["next"] if is_wide(fit) else []), "noise", "blind", "cards", "made"]  # fmt: skip
    table = next(part for part in document.sections[0].parts if getattr(part, "key", "") == "parameters")
    assert "prior" in table.columns
    assert table.rows[-1][0] == "A/youngs_modulus"
    assert table.rows[-1][-2] == "1 ± 0.02"
    assert "Fitted with it, values in the table: A/youngs_modulus." in finding_sentences(fit)
    page = jf.write_report(fit, tmp_path / "report.html").read_text()
    assert "predicted by the models and the joint found" in page
    assert "each line" not in page
    drawn = jf.plot(fit)
    assert len(drawn.axes) >= 8
    loaded = jf.load(jf.save(fit, tmp_path / "fit.json"))
    with pytest.raises(ValueError, match="this fit contains no measured FRFs"):
        jf.write_report(loaded, tmp_path / "again.html")
    assert len(jf.plot(loaded).axes) == 4


def test_the_page_and_the_plot_of_laws(tmp_path):
    section = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
    a, b = jf.beam(0.3, 12, ends=("clamped", "free"), **section), jf.beam(0.225, 9, **section)
    freq = np.arange(15.0, 801.0, 4.0)
    h_a, h_b = (m.receptance(freq, m.ports(f"{n}:y", f"{n}:theta")) for m, n in ((a, 13), (b, 1)))
    actual = jf.LawJoint({"y": jf.StandardLinearSolid(2e5, 6e5, tau=5e-4)}, rigid=["theta"])
    gamma = jf.pollute(jf.couple(h_a, h_b, actual, [0, 1], [0, 1], freq_hz=freq), level=0.02, seed=2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = jf.identify(freq, gamma, joint=actual)
    # Regenerated FRFs lie nearer to the truth than the measured ones do, and fit the joint found.
    regenerated = fit.data.regenerated(slice(None))
    true = jf.couple(h_a, h_b, actual, [0, 1], [0, 1], freq_hz=freq)
    error, noise = (np.median(abs(one - true) / abs(true)) for one in (regenerated, gamma))
    assert error < noise
    np.testing.assert_allclose(
        jf.joint_compliance(regenerated)[:, 0, 0], fit.joint.compliance(freq)[:, 0, 0], rtol=1e-3
    )
    np.testing.assert_allclose(fit.data.information().sum(axis=0), 1)
    reported = finding_sentences(fit)
    assert reported[0] == "Rigid: theta."
    assert any(one.startswith("Parameter tau of y (tau_y): 0.0005") for one in reported)
    page = jf.write_report(fit, tmp_path / "law.html").read_text()
    assert "95 % interval of Re K*" in page
    assert "The laws are taken at" in page
    assert len(jf.plot(fit).axes) >= 8


def test_the_schema_knows_what_the_reader_knows(tmp_path):
    schema = schema_of(AssemblyKeys)
    defined = schema["$defs"]
    assert set(defined["AssemblyKeys"]["required"]) == {"A", "B", "joint"}
    assert {"masses", "joint", "unknown"} <= set(defined["ChainPart"]["properties"])
    json.dumps(schema)


BEAMS = """[A]
model = "beam"
length = 0.3
elements = 6
youngs_modulus = 67e9
density = 2700.0
width = 0.025
height = 0.006
joint = ["@0.3,0,0:y", "7:theta"]

[B]
model = "beam"
length = 0.2
elements = 4
youngs_modulus = 67e9
density = 2700.0
width = 0.025
height = 0.006
joint = ["1:y", "1:theta"]

[[joint.law]]
dof = "y"
law = "spring"

[[joint.law]]
dof = "theta"
law = "spring"

[channels]
"11:+x" = "A/@0.102,0.001,0:y"
"22:-x" = "B/@(0.2, 0, 0):y"

[[mass]]
dofs = ["B/@0.2,0,0:y"]
mass = 0.003

[[ground]]
dof = "A/@0,0,0:theta"
stiffness = 10.0

[force_gains]
"A/@0.1,0,0:y" = 0.02
"""


def test_dofs_by_position_are_the_nearest_nodes_and_said(tmp_path, frfs):
    measured = jf.measured_assembly(written(tmp_path, BEAMS), frfs)
    assert (measured.responses, measured.forces) == (("A/3:y", "B/5:y"), ("A/3:y",))
    assert measured.assembly.a.joint == ("7:y", "7:theta")
    assert [one.places for one in measured.assembly.attachments] == [("B/5:y",), ("A/1:theta",)]
    assert list(measured.force_gains) == ["A/3:y"]
    assert "A/@0.102,0.001,0 is A/3, 2.24 mm away" in measured.located


def test_the_sketch_in_words_and_on_the_page(tmp_path, frfs):
    measured = jf.measured_assembly(written(tmp_path, BEAMS), frfs)
    lines = measured.describe()
    assert lines[0] == "joint between A/7 at (0.3, 0, 0) m and B/1 at (0, 0, 0) m: spring y; spring theta"
    rows = [re.split(r" {2,}", line.strip()) for line in lines]
    assert ["A/3", "0.1, 0, 0", "0.2", "response y (11:+x), force y (11:+x)"] in rows
    assert ["A/1", "0, 0, 0", "0.3", "spring to the ground"] in rows
    sketch = assembly_sketch(measured.sketched, measured.responses, measured.forces)
    assert (sketch.svg.count("<rect"), sketch.svg.count(">A/3:y<"), sketch.svg.count(" node")) == (2, 1, 7 + 5)
    # B goes on where A ends: the sensor at its end is the farthest to the right.
    places = [float(x) for x in re.findall(r'<rect class="[jk]" x="([\d.]+)"', sketch.svg)]
    nodes = [float(x) for x in re.findall(r' node" cx="([\d.]+)"', sketch.svg)]
    assert places[0] < np.median(nodes) < places[1]


def test_a_sketch_of_many_parts_has_all_joints_where_they_meet():
    def part(name, joints):
        """Return a bar of five nodes, 1 m."""
        return SketchedPart(name, {str(i): np.array([i / 4, 0, 0]) for i in range(5)}, joints)

    # A ring of three, each by its end on the middle of the next, and a mount on the ground.
    parts = [
        part("a", {"ab": ["4"], "ca": ["2"], "mount": ["0"]}), part("b", {"ab": ["2"], "bc": ["4"]}),
        part("c", {"bc": ["0"], "ca": ["4"]}),
    ]  # fmt: skip
    moved, joints = _moved_parts(parts)
    np.testing.assert_allclose([own["0"][0] for own in moved], [0, 0.5, 0.5])  # the ring does not close
    assert {name: list(ends) for name, ends in joints.items()} == {
        "ab": [0, 1],
        "ca": [0, 2],
        "mount": [0],
        "bc": [1, 2],
    }
    np.testing.assert_allclose([joints["bc"][side][0] for side in (1, 2)], [1.5, 0.5])
    sketch = assembly_sketch(parts, ["c/1:y"], ["a/0:y"])
    assert sketch.svg.count('class="joint open"') == 4 + 1
    assert all(f">{name}<" in sketch.svg for name in ("ab", "bc", "ca", "mount", "a", "b", "c", "c/1:y", "a/0:y"))
    assert "springs: the joints ab, ca, mount, bc" in sketch.caption
    assert assembly_sketch([*parts, part("loose", {"other": ["0"]})], [], []) is None


def test_the_sketch_of_a_case_of_many_parts():
    case = Path(__file__).resolve().parents[3] / "cases/four-mounts"
    measured = jf.measured_assembly(case / "assembly.toml", jf.io.read_frfs(case / "test.uff").receptance())
    sketch = assembly_sketch(measured.sketched, measured.responses, measured.forces)
    assert all(f">{name}<" in sketch.svg for name in (*measured.parts, "fl", "fr", "rl", "rr"))
    assert [line.partition(" between")[0] for line in measured.describe()[:4]] == [
        f"joint {n}" for n in ("fl", "fr", "rl", "rr")
    ]


@pytest.mark.parametrize("axis", range(3))
def test_a_sketch_is_turned_and_not_mirrored(axis):
    plain, turned = _view_along(0), _view_along(axis)
    turn = np.zeros((3, 3))
    for i, j, sign in product(range(3), range(3), (1, -1)):
        if np.allclose(turned[:, i], sign * plain[:, j]):
            turn[j, i] = sign
    np.testing.assert_allclose(plain @ turn, turned)
    assert np.linalg.det(turn) == pytest.approx(1)
    np.testing.assert_allclose(turned[:, axis], plain[:, 0])


def test_parts_of_a_page_that_are_none(tmp_path, frfs):
    fit = jf.measured_assembly(written(tmp_path), frfs).fit()
    for parts in (3, ["A"]):
        with pytest.raises(TypeError, match="parts must be a"):
            jf.write_report(fit, tmp_path / "page.html", parts=parts)


@pytest.mark.parametrize(
    ("dof", "message"),
    [
        ("A/@102,0,0:y", r"the nearest node is 102 m away, more than half the part; give the position in m"),
        ("A/@0.1,0:y", r"is no position with a direction; use the form @x,y,z:y"),
        ("A/@0.1,nan,0:y", r"is no position with a direction"),
        ("A/@0.1,0,0:z", r"no node with coordinates has a DOF z"),
    ],
)
def test_positions_where_nothing_is(tmp_path, frfs, dof, message):
    with pytest.raises(FileContentError, match=f"channels: .*{message}"):
        jf.measured_assembly(written(tmp_path, BEAMS.replace("A/@0.102,0.001,0:y", dof)), frfs)


SEVERAL = """
same = ["fl", "fr"]

[parts.machine]
model = "rigid-body"
mass = 60.0
inertia = [2.2, 3.0, 3.6]
moves = ["z", "theta_x", "theta_y"]
[parts.machine.points]
fl = [-0.3, -0.2, -0.25]
fr = [0.3, -0.2, -0.25]
rear = [0.0, 0.2, -0.25]
top = [0.1, 0.05, 0.25]
side = [0.35, 0.0, 0.0]

[parts.base]
model = "chain"
masses = [30.0]
stiffness = [4e6]
damping = [200.0]
exact = true

[joints.fl]
j = ["machine/fl:z"]
[[joints.fl.law]]
dof = "z"
law = "spring"

[joints.fr]
j = ["machine/@0.3,-0.2,-0.25:z"]
[[joints.fr.law]]
dof = "z"
law = "spring"

[joints.rear]
j = ["machine/rear:z"]
k = ["base/1:x"]
file = "mount.toml"

[channels]
"1:+z" = "machine/@0.1,0.05,0.25:z"
"2:-z" = "machine/side:z"
"""
MOUNT = '[[law]]\ndof = "z"\nlaw = "spring"\nvalues = { k = 1e5, c = 50.0 }\n'


def test_several_parts_and_joints(tmp_path):
    (tmp_path / "mount.toml").write_text(MOUNT)
    path = written(tmp_path, SEVERAL)
    freq, channels = np.arange(4.0, 40.0, 0.25), ["machine/top:z", "machine/side:z"]
    file = read_assembly_file(path)
    file, said = file.located(parts := file.parts(freq))
    believed = file.assembly(freq, parts, channels)
    assert said == ("machine/@0.1,0.05,0.25 is machine/top, 0 mm away",)
    with pytest.raises(FileContentError, match="fl: the law of z has no expected values"):
        file.check_values()
    assert (believed.joints["fr"].j, believed.joints["rear"].k) == (("machine/fr:z",), ("base/1:x",))
    true = {"fl": 2e5, "fr": 2e5, "rear": 3e5}
    joints = {name: jf.PlacedJoint(jf.LawJoint({"z": jf.SpringLaw(true[name], c=80.0)}), one.j, one.k)
              for name, one in believed.joints.items()}  # fmt: skip
    h = jf.pollute(jf.Assembly.of_parts(believed.parts, joints).receptance(freq, channels, channels[:1]), 0.03, seed=1)
    of_file = Channel(1, "+z"), Channel(2, "+z")
    frfs = FrfSet(freq, of_file, of_file[:1], h * [[1.0], [-1.0]], source="test.uff")
    measured = jf.measured_assembly(path, frfs)
    assert measured.describe()[2] == ("joint rear between machine/rear at (0, 0.2, -0.25) m and base/1: spring z")
    fit = measured.fit()
    assert [one.name for one in fit.parameters] == ["fl.k_z", "fl.c_z", "rear.k_z", "rear.c_z"]
    for name, (low, high) in fit.confidence_interval(0.99).items():
        assert low < (true[name.partition(".")[0]] if ".k" in name else 80.0) < high


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('same = ["fl", "fr"]', 'same = ["fl", "up"]', "same names 'up': there are fl, fr, rear"),
        ('same = ["fl", "fr"]', 'same = ["fl", ["fr", "rear"]]', "same must be a list of names, or of lists of names"),
        ("[joints.fl]", "[parts.lid]\nmodel = 'chain'\n[joints.fl]", "[parts.lid]: joint: no joint names a DOF of lid"),
        ("exact = true", 'exact = true\njoint = ["1:x"]', "[parts.base]: joint: the DOFs of the joints are under"),
        ('file = "mount.toml"', "", "[joints.rear]: the key 'law' is missing: law or file"),
        ('j = ["machine/rear:z"]', 'j = ["machine/back:z"]', "[parts.machine]: joint: machine has no DOF 'back:z'"),
        ('k = ["base/1:x"]', 'k = ["floor/1:x"]', "joints: rear: no part has a DOF 'floor/1:x'"),
        ('"machine/side:z"', '"machine/low:z"', "channels: none of machine, base has a DOF 'machine/low:z'"),
        ("[channels]", "[alike.rear]\njoints = ['fl', 'rear']\n[channels]", "two do not show how they scatter"),
        ("[channels]", "[A]\n[channels]", "unknown key 'A'"),
    ],
)
def test_what_is_wrong_with_several_parts(tmp_path, old, new, said):
    (tmp_path / "mount.toml").write_text(MOUNT)
    text = SEVERAL.replace(old, new, 1)
    assert text != SEVERAL
    channels = Channel(1, "+z"), Channel(2, "+z")
    frfs = FrfSet(np.arange(1.0, 21.0), channels, channels, np.ones((20, 2, 2), complex), source="test.uff")
    with pytest.raises(FileContentError, match=re.escape(said)):
        jf.measured_assembly(written(tmp_path, text), frfs)
