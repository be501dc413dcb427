"""The plain library as installed: programs in C, FORTRAN 77 and Fortran find it, and nothing else leaves it."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest
import scipy_openblas32

from abi import EXPORTED, LISTED, prototypes

ROOT = pathlib.Path(__file__).resolve().parents[3]
INSTALL = ROOT / "tests" / "install"
COMPILERS = {"c": ["gcc"], "f": ["gfortran", "-std=legacy"], "f90": ["gfortran", "-std=f2018"]}

needs_tools = pytest.mark.skipif(
    not sys.platform.startswith("linux") or not all(map(shutil.which, ("gcc", "gfortran", "nm", "readelf"))),
    reason="needs GNU compilers and binutils on Linux",
)
needs_pkg_config = pytest.mark.skipif(shutil.which("pkg-config") is None, reason="needs pkg-config")


def run(*command, **options):
    """Output of a command that must succeed."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}"
    return done.stdout


@pytest.fixture(scope="session")
def project(tmp_path_factory):
    """Folder of a project that holds jointfrf as its subproject, built in build/ and installed into prefix/."""
    folder = tmp_path_factory.mktemp("install") / "consumer"
    shutil.copytree(INSTALL, folder)
    (folder / "subprojects").mkdir()
    (folder / "subprojects" / "jointfrf").symlink_to(ROOT)
    quick = ["-Dbuildtype=plain", "-Djointfrf:buildtype=plain", "-Djointfrf:lapack=scipy-openblas32"]
    quick.append("-Djointfrf:instruction_sets=plain")
    quick += [f"-Djointfrf:lapack_python={sys.executable}", f"--prefix={folder / 'prefix'}", "-Dlibdir=lib"]
    environment = os.environ | {"PATH": f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    run("meson", "setup", "build", "-Dpkgconfig.relocatable=true", *quick, cwd=folder, env=environment)
    run("ninja", "-C", "build", cwd=folder, env=environment)
    run("meson", "install", "-C", "build", "--no-rebuild", cwd=folder, env=environment)
    return folder


@pytest.fixture(scope="session")
def static_prefix(project):
    """The installation moved elsewhere, without the shared library, which a linker would take first."""
    moved = project / "moved"
    shutil.copytree(project / "prefix", moved, ignore=shutil.ignore_patterns("*.so*"))
    return moved


@pytest.mark.builds
@needs_tools
@pytest.mark.parametrize("language", COMPILERS)
@pytest.mark.parametrize("kind", ["shared", "static"])
def test_subproject(project, kind, language):
    program = project / "build" / f"{language}_{kind}"
    run(program, env=os.environ | {"LD_LIBRARY_PATH": scipy_openblas32.get_lib_dir()})
    assert ("libjointfrf.so.0" in run("readelf", "-d", program)) == (kind == "shared")


@pytest.mark.builds
@needs_tools
@needs_pkg_config
@pytest.mark.parametrize("language", COMPILERS)
@pytest.mark.parametrize("kind", ["shared", "static", "static beside shared"])
def test_pkg_config(request, tmp_path, kind, language):
    project = request.getfixturevalue("project")
    prefix = request.getfixturevalue("static_prefix") if kind == "static" else project / "prefix"
    environment = os.environ | {"PKG_CONFIG_PATH": str(prefix / "lib" / "pkgconfig")}
    ask = ["pkg-config", "jointfrf", *([] if kind == "shared" else ["--static"])]
    flags = run(*ask, "--cflags", "--libs", env=environment).split()
    if kind == "static beside shared":
        flags[flags.index("-ljointfrf")] = "-l:libjointfrf.a"
    flags.append("-I" + run(*ask, "--variable=moduledir", env=environment).strip())
    program = tmp_path / "program"
    run(*COMPILERS[language], INSTALL / f"consumer.{language}", "-o", program, *flags, cwd=tmp_path)
    assert ("libjointfrf.so.0" in run("readelf", "-d", program)) == (kind == "shared")
    path = prefix / "lib" if kind == "shared" else scipy_openblas32.get_lib_dir()
    run(program, env=os.environ | {"LD_LIBRARY_PATH": str(path)})


@pytest.mark.builds
@needs_tools
@needs_pkg_config
@pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("ctest") is None, reason="needs CMake")
def test_cmake(project, tmp_path):
    flags = ["-G", "Ninja", f"-DCMAKE_PREFIX_PATH={project / 'prefix'}"]
    environment = os.environ | {"LD_LIBRARY_PATH": scipy_openblas32.get_lib_dir()}
    ninja = shutil.which("ninja", path=f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    run("cmake", "-S", INSTALL, "-B", tmp_path, f"-DCMAKE_MAKE_PROGRAM={ninja}", *flags)
    run("cmake", "--build", tmp_path)
    assert "100% tests passed, 0 tests failed out of 6" in run("ctest", "--test-dir", tmp_path, env=environment)
    needed = {name: run("readelf", "-d", tmp_path / name) for name in ("c_jointfrf", "c_static")}
    assert "libjointfrf" in needed["c_jointfrf"]
    assert "libjointfrf" not in needed["c_static"]


@pytest.mark.builds
@needs_tools
def test_installed_header_declares_the_listed_abi(project):
    """A line of the list that changes or goes breaks linked programs: that takes a new major version."""
    header = (project / "prefix" / "include" / "jointfrf.h").read_text()
    assert sorted(LISTED) == LISTED
    assert prototypes(header) == prototypes()
    assert "\nextern const char jf_integers_have_4_bytes_;\n" in header


@pytest.mark.builds
@needs_tools
def test_shared_library_exports_the_listed_abi(project):
    library = project / "prefix" / "lib" / "libjointfrf.so"
    exported = [
        line.split()[-1] for line in run("nm", "-D", "--defined-only", library).splitlines() if " A " not in line
    ]
    assert sorted(exported) == [f"{name}@@jointfrf_0" for name in EXPORTED]
    assert "Library soname: [libjointfrf.so.0]" in run("readelf", "-d", library)


@pytest.mark.builds
@needs_tools
def test_static_library_keeps_to_its_names(project):
    """Internal names cannot be hidden in an archive, but they cannot clash: all carry the name of the library."""
    listing = run("nm", "-g", "--defined-only", project / "prefix" / "lib" / "libjointfrf.a")
    symbols = {line.split()[2] for line in listing.splitlines() if len(line.split()) == 3}
    assert set(EXPORTED) == {name for name in symbols if name.startswith("jf_")}
    own = ("jf_", "jointfrf_", "__jointfrf_", ".gomp_critical_user_jointfrf_")
    assert [name for name in symbols if not name.startswith(own)] == []


@pytest.mark.builds
@needs_tools
def test_every_routine_has_a_page(project):
    pages = project / "prefix" / "share" / "man" / "man3"
    declared = prototypes()
    assert {path.name for path in pages.iterdir()} == {f"{name[:-1]}.3" for name in declared} | {"jointfrf.3"}
    markdown = (project / "prefix" / "share" / "doc" / "jointfrf" / "jointfrf.md").read_text()
    overview = (pages / "jointfrf.3").read_text()
    for symbol, arguments in declared.items():
        name, page = symbol[:-1], (pages / f"{symbol[:-1]}.3").read_text()
        expected = [argument.split("*")[1] for argument in arguments]
        explained = re.findall(r'^\.TP\n\.BR (\w+) " \(\w+, [^"]*\)"\n[^.\s]', page, re.MULTILINE)
        assert explained == expected, name
        assert f"void {name}({', '.join(arguments)});" in page, name
        section = markdown.split(f"## {name}\n")[1].split("\n## ")[0]
        assert re.findall(r"^- `(\w+)`", section, re.MULTILINE) == expected, name
        assert f".BR {name} (3)" in overview, name


@pytest.mark.builds
@needs_tools
@pytest.mark.skipif(shutil.which("groff") is None, reason="needs groff")
def test_pages_are_sound_roff(project):
    pages = sorted((project / "prefix" / "share" / "man" / "man3").iterdir())
    assert run("groff", "-man", "-Tascii", "-ww", "-z", "-rLL=120n", *pages) == ""
