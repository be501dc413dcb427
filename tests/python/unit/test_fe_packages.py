"""Matrices of Nastran and Ansys as these programs wrote them: the files that come with pyYeti and ansys-mapdl-reader.

Both packages are large extras, which `./tests/run --all` installs: the tests are skipped where they are not there.
"""

import random
import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.workbench.fe.matrix_formats import read_matrix

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def nastran():
    return Path(pytest.importorskip("pyyeti").__file__).parent / "tests"


def part_of(folder, keys):
    path = folder / "part.toml"
    path.write_text(f'model = "matrices"\n{keys}joint = ["3:x"]\n')
    return jf.read_part(path)


def test_a_craig_bampton_model_of_nastran(tmp_path, nastran):
    """EXTSEOUT: OUTPUT4 matrices, DOFs and grids of the .pch file; mass and rigid motions are as they must be."""
    own = nastran / "nas2cam_extseout"
    part = part_of(tmp_path, f'stiffness = "{own}/inboard.op4#kxx"\nmass = "{own}/inboard.op4#mxx"\n'
                   f'dofs = "{own}/inboard.pch"\nnodes = "{own}/inboard.pch"\nunits = "mm-t-s"\n')  # fmt: skip
    model = part.structure.model
    assert len(model.dofs) == 32
    assert sum(dof.endswith(":q") for dof in model.dofs) == 8
    assert "11:local_x" in model.dofs  # grid 11 has axes of its own
    np.testing.assert_allclose(part.places["3"], [0.6, 0, 0.3])
    # Free: six natural frequencies of 0 Hz, whatever the directions of grids are called.
    freq = model.natural_frequencies(32)
    assert freq[5] < 1e-2 * freq[6]
    lines = "\n".join(part.describe())
    assert "(Nastran, mm-t-s)" in lines
    assert "1 nodes have directions of their own" in lines


def test_arrays_print_as_before_once_a_package_is_loaded(tmp_path, monkeypatch):
    (tmp_path / "sets_printing.py").write_text("import numpy as np\nnp.set_printoptions(legacy='1.13', precision=2)\n")
    monkeypatch.syspath_prepend(tmp_path)
    import_extra("sets_printing")
    assert repr(np.array([1.23456])) == "array([1.23456])"


def test_blocks_of_output2(nastran):
    path = nastran / "cla_test_data_2020" / "residual.op2"
    found = read_matrix(path, "stiffness")
    assert found.matrix.shape == (66, 66)
    assert abs(found.matrix - found.matrix.T).max() <= 1e-9 * abs(found.matrix).max()
    with pytest.raises(
        FileContentError, match=r"contains no matrix mass, but (BHH, KHH|KHH, BHH); name one after the file"
    ):
        read_matrix(path, "mass")


@pytest.mark.parametrize("name", ["nas2cam_extseout/inboard.op4", "cla_test_data_2020/residual.op2"])
def test_damaged_files_of_nastran(tmp_path, nastran, name):
    sound, chance = (nastran / name).read_bytes()[:40_000], random.Random(3)
    path = tmp_path / Path(name).name
    for _ in range(30):
        content = bytearray(sound[: chance.randrange(1, len(sound))])
        for _ in range(chance.randrange(4)):
            start = chance.randrange(len(content))
            content[start : start + chance.randrange(1, 5)] = chance.randbytes(4)
        path.write_bytes(content)
        with warnings.catch_warnings(), suppress(FileContentError):
            warnings.simplefilter("ignore")
            read_matrix(path, "stiffness")


def test_a_full_file_of_ansys(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        examples = pytest.importorskip("ansys.mapdl.reader.examples")
        part = part_of(tmp_path, f'stiffness = "{examples.fullfile}"\nmass = "{examples.fullfile}"\n'
                       f'nodes = "{examples.hexarchivefile}"\nunits = "SI"\n'.replace("3:x", "21:x"))  # fmt: skip
    model = part.structure.model
    assert len(model.dofs) == 900
    assert "63 DOFs without any entry are held and left out" in part.structure.about
    assert "the upper triangle is stored, the rest was completed by symmetry" in part.structure.about
    # The frequencies that the documentation of the package gives for this file.
    np.testing.assert_allclose(model.natural_frequencies(4), [1283.2004, 1283.2004, 5781.9749, 6919.3989], rtol=1e-6)
    assert "no rigid motion is free" in part.describe()[2]
