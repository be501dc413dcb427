"""Spack recipe: the Python package, on the LAPACK that Spack chooses."""
# ruff: noqa: F403, F405  (Spack wants it so)

from spack.package import *


class PyJointfrf(PythonPackage):
    """Stiffness and damping of joints from frequency response functions, with a Fortran kernel."""

    license("BSD-3-Clause")

    # A release adds its `url` and `version(..., sha256=...)` here; a checkout is built by `spack develop`.
    version("main")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("python@3.11:", type=("build", "link", "run"))
    depends_on("py-meson-python@0.18:", type="build")
    depends_on("meson@1.4:", type="build")
    depends_on("py-numpy@2.0:", type=("build", "link", "run"))
    depends_on("py-scipy@1.13:", type=("build", "run"))
    depends_on("py-threadpoolctl@3.5:", type=("build", "run"))
    depends_on("py-msgspec@0.20:", type=("build", "run"))
    depends_on("blas")
    depends_on("lapack")

    def patch(self):
        """Take out scipy-openblas32: it brings a LAPACK to wheels."""
        filter_file(r', "scipy-openblas32>=[0-9.]*"', "", "pyproject.toml")

    def config_settings(self, spec, prefix):
        """Link the LAPACK of the specification."""
        return {"setup-args": "-Dlapack=system"}
