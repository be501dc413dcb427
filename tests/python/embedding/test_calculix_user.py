"""A user subroutine of CalculiX that calls the library: compiled and called, and run in CalculiX where it was built.

CCX_BUILD names the folder of its sources in which ``make`` left ``ccx_2.20.o`` and ``ccx_2.20.a`` (Debian:
``apt-get source calculix-ccx``, ``libspooles-dev libarpack2-dev liblapack-dev``).
"""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from installed_library import ROOT, InstalledLibrary, run

pytestmark = pytest.mark.builds

SOURCE = ROOT / "tests" / "calculix" / "uamplitude.f"
MASS_A, MASS_B = 3.0, 7800.0 * 0.1 * 0.06 * 0.04
STIFFNESS, DAMPING, LOSS = 2e6, 40.0, 0.05
FREQ = np.linspace(10.0, 1000.0, 100)
DRIVER = """      PROGRAM DRIVER
      REAL*8 F, RE, IM
      CHARACTER*80 NAME(2)
      NAME(1) = 'JOINT_RE'
      NAME(2) = 'JOINT_IM'
   10 READ(*, *, END=20) F
      CALL UAMPLITUDE(F, NAME(1), RE)
      CALL UAMPLITUDE(F, NAME(2), IM)
      WRITE(*, '(2ES25.16)') RE, IM
      GOTO 10
   20 END
"""


def motions(freq):
    """Receptances of A and B along x for a force of 1 on A, from two masses and the joint."""
    omega = 2 * np.pi * freq
    k = STIFFNESS * (1 + 1j * LOSS) + 1j * omega * DAMPING
    z = np.array([[k - omega**2 * MASS_A, -k], [-k, k - omega**2 * MASS_B]])
    return np.array([np.linalg.solve(z[:, :, i], [1.0, 0.0]) for i in range(freq.size)]), k


def write_joint(folder):
    rows = [f"{f:.9g} {1 / MASS_A:.17g} 0 {1 / MASS_B:.17g} 0" for f in FREQ]
    (folder / "joint.txt").write_text("\n".join([f"{FREQ.size} {STIFFNESS} {DAMPING} {LOSS}", *rows, ""]))


def flags_of(library: InstalledLibrary) -> list[str]:
    (lib_dir,) = library.pkg_config("--variable=libdir")
    return [*library.pkg_config("--cflags", "--libs"), f"-Wl,-rpath,{lib_dir}"]


def test_the_force_of_the_joint(installed_library, tmp_path):
    (tmp_path / "driver.f").write_text(DRIVER)
    driver = tmp_path / "driver"
    flags = ["-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror", "-O2"]  # constants of jointfrf.inc
    run(["gfortran", *flags, "-o", driver, tmp_path / "driver.f", SOURCE, *flags_of(installed_library)])
    write_joint(tmp_path)
    freq = np.array([10.0, 33.3, 200.0, 214.7, 999.9, 1000.0])
    text = run([driver], cwd=tmp_path, input="\n".join(map(str, freq)))
    found = np.array([[float(word) for word in line.split()] for line in text.splitlines()])
    u, k = motions(freq)
    np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], k * (u[:, 0] - u[:, 1]), rtol=1e-10)
    done = subprocess.run([tmp_path / "driver"], cwd=tmp_path, input="5.0", capture_output=True, text=True, check=False)
    assert done.returncode == 201
    assert "*ERROR in uamplitude: no FRF at" in done.stdout
    (tmp_path / "joint.txt").unlink()
    done = subprocess.run(
        [tmp_path / "driver"], cwd=tmp_path, input="50.0", capture_output=True, text=True, check=False
    )
    assert done.returncode == 201
    assert "joint.txt is missing or wrong" in done.stdout


def test_calculix_with_the_subroutine(installed_library, tmp_path):
    own = os.environ.get("CCX_BUILD")
    if own is None:
        pytest.skip("CCX_BUILD names no folder with CalculiX as it was built")
    (main,), (archive,) = (sorted(Path(own).glob(f"ccx_*.{ending}")) for ending in ("o", "a"))
    run(["gfortran", "-O2", "-c", SOURCE, "-o", tmp_path / "uamplitude.o", *installed_library.pkg_config("--cflags")])
    run(
        ["gfortran", "-fopenmp", "-o", tmp_path / "ccx", main, tmp_path / "uamplitude.o", archive, "-lspooles",
         "-larpack", "-llapack", "-lblas", "-lpthread", "-lm", *flags_of(installed_library)]
    )  # fmt: skip
    write_joint(tmp_path)
    (tmp_path / "mount.inp").write_text(SOURCE.with_name("mount.inp").read_text())
    assert "Job finished" in run([tmp_path / "ccx", "mount"], cwd=tmp_path, env={"OMP_NUM_THREADS": "1"})
    rows = re.findall(r"for set JOINT and time\s+(\S+)\n\n\s+9\s+(\S+)", (tmp_path / "mount.dat").read_text())
    freq = np.array([float(f) for f, _ in rows[::2]])
    found = np.array([float(re_) + 1j * float(im) for (_, re_), (_, im) in zip(rows[::2], rows[1::2], strict=True)])
    exact = motions(freq)[0][:, 1]
    assert freq.size >= 20
    assert (abs(found - exact) < 1e-5 * abs(exact)).all()
