"""The case of a measured plate: its command, and the clamp by frequencies alone where the files are there."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from shared_data import shared_data

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def case() -> ModuleType:
    spec = importlib.util.spec_from_file_location("measured_plate", ROOT / "cases" / "measured-plate" / "run.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_absent_and_other_files_are_named_with_their_source(case, tmp_path):
    with pytest.raises(SystemExit, match=r"lacks 00A_Ref_1.MAT, .*; get them from https://"):
        case.main([str(tmp_path)])
    for name in case.FILES:
        (tmp_path / name).write_bytes(b"none")
    with pytest.raises(SystemExit, match=r"00A_Ref_1.MAT has the SHA-256 [0-9a-f]{64}, not 7cb9"):
        case.main([str(tmp_path)])


def test_both_files_read_the_channels_that_are_used(case):
    """Points, region and laws of both assemblies, without measured numbers."""
    import jointfrf as jf

    freq = np.arange(40.0, 60.0)
    names = tuple(jf.io.Channel.parse(f"{k}:+z") for k in (2, 9, 20, 38, 41, 45))
    frfs = jf.io.FrfSet(
        freq, names, (jf.io.Channel.parse("30:-z"),), np.ones((freq.size, 6, 1), complex), "accelerance"
    )
    for file, unit in (("assembly.toml", "N/m per m^2"), ("edge.toml", "N/m per m")):
        own = jf.measured_assembly(ROOT / "cases" / "measured-plate" / file, frfs)
        assert own.assembly.joint.quantities[0].unit == unit
        assert all("0 mm away" in text for text in own.located)


def test_modes_of_the_plate_are_those_measured(case, capsys):
    """One stiffness per area gives the frequencies within 1.5 %, and shapes with a MAC above 0.95."""
    folder = shared_data("plate")
    case.main([str(folder), "--no-fit"])
    said = capsys.readouterr().out
    assert "29:+z is no driving point" in said
    assert "those of 30:+z" in said or "; 30:+z" in said
    assert "look like receptances" not in said
    frfs = case.read(folder / "00A_Ref_1.MAT")
    modes = case.modes_of(frfs)
    plate = case.Plate(case.in_bands(frfs, case.LOW))
    freq, shapes, _ = plate.modes(2.7e11, 0.994 * case.E)
    for measured, (mode, mac) in zip(modes.freq_hz, case.matched(modes, frfs, shapes), strict=True):
        assert freq[mode] == pytest.approx(measured, rel=0.015)
        assert mac > 0.95
