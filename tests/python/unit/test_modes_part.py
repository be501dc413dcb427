"""Parts known by their modes: files of programs, scales, units, residuals; beside the FRFs of the models."""

import re
import warnings
from contextlib import suppress

import numpy as np
import pytest
import pyuff
from scipy import linalg, sparse

import jointfrf as jf
from jointfrf.errors import FileContentError
from jointfrf.io import Channel, FrfSet, write_frfs

FREQ = np.linspace(5.0, 400.0, 120)
BEAM = jf.beam(0.6, 4, youngs_modulus=70e9, density=2700.0, width=0.03, height=0.01)
DOFS = [dof.replace("theta", "theta_z") for dof in BEAM.dofs]
NODES = range(1, 6)
PART = 'model = "modes"\nfile = "modes.{}"\njoint = ["1:y", "1:theta_z"]\n'


def full(matrix):
    return matrix.toarray() if sparse.issparse(matrix) else np.array(matrix)


def normal_modes(model, damping=0.01):
    """Natural frequencies, Hz, shapes of unit modal mass, and the model with these damping ratios."""
    k, m = full(model.stiffness), full(model.mass)
    squared, shapes = linalg.eigh(k, m)
    omega = np.sqrt(np.maximum(squared, 0))
    omega[squared < 1e-9 * squared[-1]] = 0
    c = m @ shapes @ np.diag(2 * damping * omega) @ shapes.T @ m
    return omega / (2 * np.pi), shapes, jf.Model(k, m, model.dofs, damping=c)


def written_uff(path, modes, *, length=1.0, force=1.0):
    """Write modes by pyuff: factors are those of dataset 164, by which SI values are multiplied."""
    datasets = [{"type": 164, "units_code": 10, "units_description": "own", "temp_mode": 1, "length": length,
                 "force": force, "temp": 1.0, "temp_offset": 0.0}]  # fmt: skip
    for number, (shape, facts) in enumerate(modes, 1):
        rows = {f"r{i + 1}": np.zeros(len(NODES), shape.dtype) for i in range(6)}
        for dof, value in zip(DOFS, shape, strict=True):
            node, direction = dof.split(":")
            at = ("x", "y", "z", "theta_x", "theta_y", "theta_z").index(direction)
            rows[f"r{at + 1}"][int(node) - 1] = value * (length if at < 3 else 1.0)
        datasets.append(
            {"type": 55, "id1": "mode", "id2": "NONE", "id3": "NONE", "id4": "NONE", "id5": "NONE", "model_type": 1,
             "data_ch": 3, "spec_data_type": 8, "data_type": 5 if np.iscomplexobj(shape) else 2, "n_data_per_node": 6,
             "load_case": 0, "mode_n": number, "node_nums": np.array(NODES), **rows, **facts})  # fmt: skip
    pyuff.UFF(str(path)).write_sets(datasets, mode="overwrite")


def part_of(folder, suffix, more=""):
    (folder / "part.toml").write_text(PART.format(suffix) + more)
    return jf.read_part(folder / "part.toml")


@pytest.mark.parametrize(("length", "force"), [(1.0, 1.0), (1e3, 1.0), (1e3, 1e-3)])
def test_normal_modes_of_a_universal_file(tmp_path, length, force):
    """All modes of a free beam, rigid ones at 0 Hz, are its FRFs; in m, N, in mm, N and in mm, kN."""
    freq, shapes, damped = normal_modes(BEAM)
    unit = length * force  # of kg m^2
    modes = [(shape, {"analysis_type": 2, "freq": f, "modal_m": unit, "modal_damp_vis": 0.01, "modal_damp_his": 0.0})
             for f, shape in zip(freq, shapes.T, strict=True)]  # fmt: skip
    written_uff(tmp_path / "modes.uff", modes, length=length, force=force)
    part = part_of(tmp_path, "uff")
    own = ["1:y", "1:theta_z", "5:y"]
    expected = damped.receptance(FREQ, damped.ports("1:y", "1:theta", "5:y"))
    np.testing.assert_allclose(part.receptance(FREQ, own), expected, rtol=2e-3, atol=1e-5 * abs(expected).max())
    assert re.match(r"modes.uff: 8 modes of 30 DOFs, \S+ to \S+ Hz, damping ratios 0.01 to 0.01; 2 rigid motions",
                    part.describe()[0])  # fmt: skip


def complex_modes(model):
    """Poles of the upper half plane, shapes, modal A."""
    k, m, c = full(model.stiffness), full(model.mass), full(model.damping)
    n = len(k)
    zero = np.zeros((n, n))
    values, vectors = linalg.eig(np.block([[zero, np.eye(n)], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]]))
    kept = values.imag > 0
    poles, shapes = values[kept], vectors[:n, kept]
    modal_a = np.array([psi @ (2 * s * m + c) @ psi for s, psi in zip(poles, shapes.T, strict=True)])
    return poles, shapes, modal_a


def complex_dataset(pole, shape, modal_a, kind=55):
    """Dataset 55 or 2414 by its definition: pyuff writes three of the six complex values of a node."""
    ints = "".join(f"{i:10d}" for i in (1, 3, 3, 8, 5, 6))
    facts = numbers([pole, modal_a, -pole * modal_a])
    lines = ["    -1", f"{kind:6d}"]
    if kind == 55:
        lines += ["mode", *["NONE"] * 4, ints, "".join(f"{i:10d}" for i in (2, 6, 0, 1)), facts]
    else:
        lines += [f"{1:10d}", "mode", f"{1:10d}", *["NONE"] * 5, ints, f"{0:10d}" * 8, f"{0:10d}" * 2]
        lines += [numbers([0, 0, 0]), facts]
    for node in NODES:
        own = dict.fromkeys(("x", "y", "z", "theta_x", "theta_y", "theta_z"), 0j)
        own |= {dof.split(":")[1]: v for dof, v in zip(DOFS, shape, strict=True) if dof.startswith(f"{node}:")}
        values = [*own.values()]
        lines += [f"{node:10d}", numbers(values[:3]), numbers(values[3:])]
    return "\n".join([*lines, "    -1", ""])


def numbers(values):
    return "".join(f"{part:13.5E}" for value in values for part in (value.real, value.imag))


def damped_beam():
    k = full(BEAM.stiffness)
    c = np.zeros_like(k)
    c[0, 0], k[0, 0], k[-2, -2] = 40.0, k[0, 0] + 1e5, k[-2, -2] + 2e5
    return jf.Model(k, full(BEAM.mass), BEAM.dofs, damping=c + 1e-5 * k)


@pytest.mark.parametrize("kind", [55, 2414])
def test_complex_modes_of_a_universal_file(tmp_path, kind):
    """A dashpot at one end: shapes are complex, and no normal modes give these FRFs. The file has conjugates, too."""
    model = damped_beam()
    poles, shapes, modal_a = complex_modes(model)
    both = zip([*poles, *poles.conj()], [*shapes.T, *shapes.T.conj()], [*modal_a, *modal_a.conj()], strict=True)
    (tmp_path / "modes.uff").write_text("".join(complex_dataset(*mode, kind) for mode in both))
    with pytest.raises(FileContentError, match=r"modes without units \(there is no dataset 164\); give units=SI"):
        part_of(tmp_path, "uff")
    found = part_of(tmp_path, "uff", 'units = "SI"\n').receptance(FREQ, ["1:y", "5:y"])
    expected = model.receptance(FREQ, model.ports("1:y", "5:y"))
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-4 * abs(expected).max())


def arrays(kind):
    """Arrays as programs have them, of the modes of the held beam."""
    poles, shapes, modal_a = complex_modes(damped_beam())
    residues = np.einsum("pm,qm,m->pqm", shapes, shapes, 1 / modal_a)
    names = {"dofs": np.array(DOFS)}
    if kind == "sdypy-EMA":
        return names | {"nat_freq": abs(poles) / (2 * np.pi), "nat_xi": -poles.real / abs(poles),
                        "A": residues[:, 8], "driving_point": 8, "LR": np.zeros(10), "UR": np.zeros(10)}  # fmt: skip
    if kind == "scaled shapes":
        mass = modal_a / (2j * poles.imag)
        return names | {"Fn": abs(poles) / (2 * np.pi), "Xi": -poles.real / abs(poles),
                        "Phi": shapes / np.sqrt(mass), "modal_mass": np.ones(poles.size)}  # fmt: skip
    return names | {"poles": poles, "residues": residues}


@pytest.mark.parametrize("kind", ["sdypy-EMA", "scaled shapes", "all residues"])
def test_modes_of_arrays(tmp_path, kind):
    np.savez(tmp_path / "modes.npz", **arrays(kind))
    part = part_of(tmp_path, "npz")
    model = damped_beam()
    expected = model.receptance(FREQ, model.ports("1:y", "1:theta", "5:y"))
    np.testing.assert_allclose(part.receptance(FREQ, ["1:y", "1:theta_z", "5:y"]), expected, rtol=1e-8)
    said = part.describe()
    assert len([line for line in said if "with the driving point only" in line]) == (2 if kind == "sdypy-EMA" else 0)


def test_residuals_of_measured_frfs_stand_for_other_modes(tmp_path):
    """Four of ten modes: the FRFs at the joint are wrong by many per cent, with residuals by less than a hundredth."""
    freq, shapes, damped = normal_modes(BEAM)
    np.savez(tmp_path / "modes.npz", frequency=freq[:6], damping=0.01, phi=shapes[:, :6], modal_mass=1.0, dofs=DOFS)
    channels = [Channel(1, "+y"), Channel(1, "+rz"), Channel(5, "-y")]
    h = damped.receptance(FREQ, damped.ports("1:y", "1:theta", "5:y"))
    signs = np.array([1, 1, -1])
    write_frfs(tmp_path / "part.uff", FrfSet(FREQ, channels, channels, h * signs * signs[:, None], "receptance"))
    own, missed = ["1:y", "1:theta_z", "5:y"], {}
    for more in ("", 'residuals = "part.uff"\n'):
        part = part_of(tmp_path, "npz", more)
        error = part.receptance(FREQ, own) - h
        missed[more] = np.median(abs(error) / abs(h), axis=0)
    plain, better = missed.values()
    assert plain[1, 1] > 0.2
    assert (better < 0.1 * plain).all()
    assert re.search(r"residuals of 9 FRFs of \S+: without them the modes miss these by \S+ % \(median\), with them by",
                     part.describe()[1])  # fmt: skip
    # One column: the others by reciprocity, or not at all.
    write_frfs(tmp_path / "part.uff", FrfSet(FREQ, channels, channels[:1], (h * signs * signs[:, None])[:, :, :1],
                                             "receptance"))  # fmt: skip
    column = part_of(tmp_path, "npz", 'residuals = "part.uff"\n').receptance(FREQ, own)
    np.testing.assert_allclose(column[:, :, 0], part.receptance(FREQ, own)[:, :, 0], rtol=1e-6)
    np.testing.assert_allclose(column[:, 0, 2], column[:, 2, 0], rtol=1e-9)
    np.testing.assert_allclose(column[:, 1, 1], h[:, 1, 1] + (column - h)[:, 1, 1])


def test_a_joint_of_a_part_of_modes(tmp_path):
    """The joint of a test whose side j is known by its modes."""
    freq, shapes, damped = normal_modes(BEAM)
    np.savez(tmp_path / "modes.npz", frequency=freq, damping=0.01, phi=shapes, modal_mass=1.0, dofs=DOFS)
    other = "youngs_modulus = 70e9\ndensity = 2700.0\nwidth = 0.03\nheight = 0.01\nloss_factor = 0.01\nexact = true\n"
    (tmp_path / "assembly.toml").write_text(
        "[A]\n" + PART.format("npz").replace("1:", "5:") + '[B]\nmodel = "beam"\nlength = 0.4\nelements = 4\n' + other +
        'joint = ["1:y", "1:theta"]\n[[joint.law]]\ndof = "y"\nlaw = "spring"\n[[joint.law]]\ndof = "theta_z"\n'
        'law = "spring"\n[channels]\n"1:+y" = "A/1:y"\n"2:+y" = "A/4:y"\n"3:+y" = "B/5:y"\n'
    )  # fmt: skip
    b = jf.beam(0.4, 4, youngs_modulus=70e9, density=2700.0, width=0.03, height=0.01, loss_factor=0.01)
    truth = jf.Assembly(jf.Substructure(damped, ["5:y", "5:theta"]), jf.Substructure(b, ["1:y", "1:theta"]),
                        jf.Joint([4e5, 2e3], [10.0, 0.3], ["y", "theta_z"]))  # fmt: skip
    dofs = ["A/1:y", "A/4:y", "B/5:y"]
    h = jf.pollute(truth.receptance(FREQ, dofs, dofs[:1]), 0.02, seed=5)
    channels = [Channel(n, "+y") for n in (1, 2, 3)]
    measured = jf.measured_assembly(tmp_path / "assembly.toml", FrfSet(FREQ, channels, channels[:1], h, "receptance"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = measured.fit()
    for name, true in (("k_y", 4e5), ("k_theta_z", 2e3)):
        low, high = fit.confidence_interval(0.99)[name]
        assert low < true < high
        assert fit.value[name] == pytest.approx(true, rel=0.05)
    assert any(line.startswith("A: modes.npz: 8 modes") for line in measured.describe())


def test_a_normal_mode_of_dataset_2414(tmp_path):
    """Three real values of a node; frequency, modal mass and damping stand in the twelfth record."""
    freq, shapes, _ = normal_modes(BEAM)
    lines = ["    -1", "  2414", f"{1:10d}", "mode 4", f"{1:10d}", *["NONE"] * 5]
    lines += ["".join(f"{i:10d}" for i in (1, 2, 2, 8, 2, 3)), f"{0:10d}" * 8, f"{0:10d}" * 2]
    lines += ["".join(f"{x:13.5E}" for x in (0.0, freq[3], 0.0, 1.0, 0.02, 0.0)), numbers([0, 0, 0])]
    for node, y in zip(NODES, shapes[::2, 3], strict=True):
        lines += [f"{node:10d}", "".join(f"{x:13.5E}" for x in (0.0, y, 0.0))]
    (tmp_path / "modes.uff").write_text("\n".join([*lines, "    -1", ""]))
    (tmp_path / "part.toml").write_text('model = "modes"\nfile = "modes.uff"\njoint = ["1:y"]\nunits = "mm-t-s"\n')
    h = jf.read_part(tmp_path / "part.toml").receptance(FREQ, ["1:y", "5:y"])
    omega, own = 2 * np.pi * FREQ[:, None, None], 2 * np.pi * freq[3]
    phi = shapes[[0, 8], 3]
    expected = np.outer(phi, phi) / (own**2 - omega**2 + 2j * 0.02 * own * omega)
    np.testing.assert_allclose(h, 1e-3 * expected, rtol=1e-4)  # shapes in mm, the modal mass in t mm^2


SHAPES = {"frequency": [10.0, 20.0], "damping": 0.01, "phi": np.ones((2, 2)), "modal_mass": 1.0, "dofs": ["1:y", "2:y"]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modal_mass": None}, "contains shapes without modal_mass, so without a scale"),
        ({"modal_mass": [1.0, 0.0]}, "mode 2 has no modal mass, so that its shape has no scale"),
        ({"modal_mass": [1.0, -1.0]}, "negative modal masses"),
        ({"damping": 1.5}, "damping ratios that are not between 0 and 1"),
        ({"frequency": [10.0, np.nan]}, "numbers that are not finite"),
        ({"frequency": None}, "must contain poles, or frequencies and damping"),
        ({"frequency": [10.0, 20.0, 30.0]}, "must be DOFs x 3 modes, not 2 x 2"),
        ({"poles": [3 - 10j, -1 + 20j]}, "poles of the upper half plane only"),
        (
            {"phi": None},
            "must contain residues, or shapes and modal_mass; it contains frequency, damping, modal_mass, dofs",
        ),
        ({"phi": None, "A": np.ones((2, 2))}, "must contain driving_point"),
        ({"phi": None, "A": np.ones((2, 2)), "driving_point": 2}, "driving_point must be one of its 2 rows"),
        ({"phi": None, "A": np.eye(2), "driving_point": 0}, "mode 2 does not move its driving point"),
        ({"phi": None, "A": np.ones((2, 3, 2))}, "residues must be DOFs x modes, or DOFs x DOFs x modes"),
        ({"UR": np.ones(3)}, "upper residuals must be one for each DOF, or DOFs x DOFs"),
        ({"dofs": None}, "dofs is missing|does not name its DOFs"),
        ({"dofs": ["1:y", "1:uy"]}, "a DOF is named twice"),
        ({"dofs": ["1:y"]}, "1 names; give 2, one for each DOF"),
        (
            {"phi": None, "modal_mass": None, "poles": [0, -1 + 20j], "A": np.ones((2, 2)), "driving_point": 0},
            "complex modes at 0 Hz have no scale",
        ),
        ({"damping": ["x"]}, "cannot be read as a file of modes"),
    ],
)
def test_arrays_that_are_no_modes(tmp_path, change, message):
    held = {name: value for name, value in (SHAPES | change).items() if value is not None}
    np.savez(tmp_path / "modes.npz", **held)
    with pytest.raises(FileContentError, match=message):
        part_of(tmp_path, "npz")


def test_universal_files_without_modes_and_cut_ones(tmp_path):
    channels = [Channel(1, "+y")]
    write_frfs(tmp_path / "modes.uff", FrfSet(FREQ, channels, channels, np.ones((FREQ.size, 1, 1)), "receptance"))
    with pytest.raises(FileContentError, match="contains no modes: no dataset 55 or 2414 of normal or complex modes"):
        part_of(tmp_path, "uff")
    freq, shapes, _ = normal_modes(BEAM)
    facts = {"analysis_type": 2, "modal_m": 1.0, "modal_damp_vis": 0.01, "modal_damp_his": 0.0}
    written_uff(tmp_path / "modes.uff", [(shapes[:, 3], facts | {"freq": freq[3]})])
    whole = (tmp_path / "modes.uff").read_bytes()
    rng = np.random.default_rng(3)
    for place in range(20, len(whole), 61):
        damaged = whole[:place] + bytes(rng.integers(32, 126, 9, dtype=np.uint8)) + whole[place + 9 :]
        for content in (whole[:place], damaged):
            (tmp_path / "modes.uff").write_bytes(content)
            with suppress(FileContentError):  # anything else is a failure
                part_of(tmp_path, "uff")
