"""Runs the tests of numbers on the machine and with the Python that start this file, on the package installed there.

    python tests/portability/numerical.py [PYTEST ARGUMENT...]    # files named there are run instead of those below

They start no other process, compile nothing and read no measured files, so that they also run in an emulator.
"""

import os
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

FILES = (
    *(
        "unit/test_engines.py",
        "unit/test_sweep.py",
        "unit/test_noise.py",
        "unit/test_manifold.py",
        "unit/test_brick.py",
    ),
    *(
        "unit/test_line_forms.py",
        "unit/test_line_pieces.py",
        "unit/test_diagonal_minimum.py",
        "unit/test_joint_terms.py",
    ),
    *("unit/test_interpolation.py", "unit/test_virtual_point.py", "unit/test_laws.py", "unit/test_methods.py"),
    *("physics/test_physics.py", "physics/test_torture.py", "physics/test_receptance.py", "physics/test_bodies.py"),
    *("physics/test_algebra_properties.py", "physics/test_monte_carlo.py", "physics/test_compliance_noise.py"),
)

if __name__ == "__main__":
    os.chdir(Path(__file__).resolve().parents[2])
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # looking for them takes minutes in an emulator
    settings.register_profile("emulator", suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("emulator")
    options = ["-q", "-m", "not builds and not long", "-p", "no:cacheprovider", "-p", "pytest_timeout"]
    files = [] if any(word.startswith("tests/") for word in sys.argv) else [f"tests/python/{name}" for name in FILES]
    sys.exit(pytest.main([*options, *files, *sys.argv[1:]]))
