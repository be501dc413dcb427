"""The library with integers of eight bytes: the same numbers, and neither library serves a program of the other."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import jointfrf as jf
from abi import EXPORTED, prototypes
from installed_library import CHECKED, COMPILERS, ROOT, InstalledLibrary, install, run

pytestmark = pytest.mark.builds

TESTS = ROOT / "tests"
CASES = ["f77/case.f", "fortran/case.f90", "c/case.c"]
CONSUMERS = {language: TESTS / "install" / f"consumer.{language}" for language in ("f", "f90", "c")}
#: Its lower half is 1.
LONG = 2**32 + 1


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> dict[int, InstalledLibrary]:
    """Both libraries below one prefix, by the bytes of their integers."""
    folder = tmp_path_factory.mktemp("installed")
    return {n_bytes: install(build, folder) for n_bytes, build in CHECKED.items()}


@pytest.fixture(scope="module")
def library64(libraries) -> ctypes.CDLL:
    (folder,) = libraries[8].pkg_config("--variable=libdir")
    return ctypes.CDLL(str(Path(folder) / "libjointfrf64.so"))


def default_integer(n_bytes: int, suffix: str) -> list[str]:
    """Tell the compiler how long default integers are."""
    return ["-fdefault-integer-8"] if n_bytes == 8 and suffix != ".c" else []


def refusal(library: InstalledLibrary, source: Path, program: Path, *flags: str) -> str:
    """Return what compiler or linker say of a program that must not come about."""
    (module_dir,) = library.pkg_config("--variable=moduledir")
    command = [*COMPILERS[source.suffix], *flags, f"-I{module_dir}", source, "-o", program]
    done = subprocess.run([*command, *library.pkg_config("--cflags", "--libs")], capture_output=True, text=True)
    assert done.returncode != 0
    return done.stderr


@pytest.mark.parametrize("source", CASES)
@pytest.mark.parametrize("engine", ["lapack", "auto"])
def test_same_text_to_the_last_bit(libraries, tmp_path, source, engine):
    texts = []
    for n_bytes, library in libraries.items():
        flags = default_integer(n_bytes, Path(source).suffix)
        program = library.compile(TESTS / source, tmp_path / f"case{n_bytes}", *flags)
        texts.append(run([program], env={"JOINTFRF_ENGINE": engine, "OMP_NUM_THREADS": "2"}))
    assert len(texts[0].splitlines()) > 4000
    assert texts[0] == texts[1]


@pytest.mark.parametrize("language", CONSUMERS)
@pytest.mark.parametrize("n_bytes", [4, 8])
def test_programs_find_what_is_installed(libraries, tmp_path, language, n_bytes):
    source = CONSUMERS[language]
    flags = [*default_integer(n_bytes, source.suffix), "-Wno-error"]
    program = libraries[n_bytes].compile(source, tmp_path / "program", *flags)
    run([program])
    assert f"[lib{libraries[n_bytes].name}.so.0]" in run(["readelf", "-d", program])


@pytest.mark.parametrize("language", CONSUMERS)
@pytest.mark.parametrize("n_bytes", [4, 8])
def test_static_library(libraries, tmp_path, language, n_bytes):
    library, source = libraries[n_bytes], CONSUMERS[language]
    (module_dir,) = library.pkg_config("--variable=moduledir")
    flags = library.pkg_config("--static", "--cflags", "--libs")
    flags[flags.index(f"-l{library.name}")] = f"-l:lib{library.name}.a"
    flags += [flag.replace("-L", "-Wl,-rpath,") for flag in flags if flag.startswith("-L")]
    compiler = [*COMPILERS[source.suffix], *default_integer(n_bytes, source.suffix), f"-I{module_dir}"]
    run([*compiler, source, "-o", tmp_path / "program", *flags])
    run([tmp_path / "program"])
    assert "libjointfrf" not in run(["readelf", "-d", tmp_path / "program"])


@pytest.mark.parametrize(("option", "end"), [("-fno-underscoring", ""), ("-fsecond-underscore", "__")])
@pytest.mark.parametrize("n_bytes", [4, 8])
def test_hosts_that_spell_symbols_otherwise(libraries, tmp_path, n_bytes, option, end):
    """FORTRAN 77 without the module: the compiler makes the symbol of the name."""
    library = libraries[n_bytes]
    usual = run([library.compile(TESTS / "f77" / "case.f", tmp_path / "usual", *default_integer(n_bytes, ".f"))])
    host = library.compile(TESTS / "f77" / "case.f", tmp_path / "host", option, *default_integer(n_bytes, ".f"))
    wanted = {line.split()[-1].partition("@")[0] for line in run(["nm", "-D", host]).splitlines() if " U jf_" in line}
    assert len(wanted) > 4
    assert all(name == name.rstrip("_") + end for name in wanted)
    assert run([host]) == usual
    flags = library.pkg_config("--static", "--libs")
    flags[flags.index(f"-l{library.name}")] = f"-l:lib{library.name}.a"
    flags += [flag.replace("-L", "-Wl,-rpath,") for flag in flags if flag.startswith("-L")]
    compiler = [*COMPILERS[".f"], option, *default_integer(n_bytes, ".f"), *library.pkg_config("--cflags")]
    run([*compiler, "-O2", "-ffp-contract=off", TESTS / "f77" / "case.f", "-o", tmp_path / "static", *flags])
    assert run([tmp_path / "static"]) == usual
    assert "libjointfrf" not in run(["readelf", "-d", tmp_path / "static"])


@pytest.mark.skipif(shutil.which("patch") is None, reason="needs patch")
@pytest.mark.parametrize("option", ["", "-fsecond-underscore"])
def test_a_program_with_a_joint_prints_the_same_with_long_integers(libraries, tmp_path, option):
    """The plane frames of tests/f77, whose COMMON blocks, work arrays and calls all have the longer integers."""
    folder = tmp_path / "f77"
    folder.mkdir()
    for name in ("frame.f", "frame.inc", "frame.deck", "README.md"):
        shutil.copy(TESTS / "f77" / name, folder)
    run(["patch", "-p1", "-i", TESTS / "f77" / "frame-joint.patch"], cwd=folder)
    cards = [line for line in (folder / "README.md").read_text().splitlines() if line.startswith("JOINT ")]
    deck = (folder / "frame.deck").read_text().replace("END\n", "\n".join([*cards, "END\n"]))
    texts = []
    for n_bytes, library in libraries.items():
        program, options = tmp_path / f"frame{n_bytes}", [*option.split(), *default_integer(n_bytes, ".f")]
        flags = [*library.pkg_config("--cflags", "--libs"), f"-Wl,-rpath,{library.pkg_config('--variable=libdir')[0]}"]
        run([*COMPILERS[".f"], "-O2", "-ffp-contract=off", *options, "frame.f", "-o", program, *flags], cwd=folder)
        texts.append(run([program], input=deck))
    assert cards
    assert len(texts[0].splitlines()) > 900
    assert texts[0] == texts[1]


@pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("ctest") is None, reason="needs CMake")
def test_cmake(libraries, tmp_path):
    flags = ["-DVARIANT=jointfrf64", "-DCMAKE_Fortran_FLAGS=-fdefault-integer-8"]
    path = f"-DCMAKE_PREFIX_PATH={libraries[8].prefix}"
    run(["cmake", "-S", TESTS / "install", "-B", tmp_path, "-G", "Ninja", path, *flags])
    run(["cmake", "--build", tmp_path])
    (lib_dir,) = (
        flag[2:] for flag in libraries[8].pkg_config("--static", "--libs") if "openblas" in flag and "-L" in flag
    )
    done = run(["ctest", "--test-dir", tmp_path], env={"LD_LIBRARY_PATH": lib_dir})
    assert "100% tests passed, 0 tests failed out of 6" in done


@pytest.mark.parametrize(("own", "other"), [(4, 8), (8, 4)])
@pytest.mark.parametrize("form", ["f", "f90"])
def test_include_file_refuses(libraries, tmp_path, own, other, form):
    source = tmp_path / f"program.{form}"
    source.write_text("      include 'jointfrf.inc'\n      end\n")
    words = refusal(libraries[own], source, tmp_path / "program", *default_integer(other, source.suffix))
    (error,) = re.findall(r"^(?:Fatal )?Error: (.*)$", words, re.MULTILINE)
    assert f"jf_integers_have_{other}_bytes" in error
    assert f"jf_link_{libraries[other].name}‘" in error.replace("’", "‘")
    assert f"jf_or_compile_with_{own}_bytes" in error
    libraries[own].compile(source, tmp_path / "good", *default_integer(own, source.suffix), "-Wno-unused-parameter")


@pytest.mark.parametrize(("own", "other"), [(4, 8), (8, 4)])
def test_module_refuses(libraries, tmp_path, own, other):
    source = TESTS / "fortran" / "case.f90"
    words = refusal(libraries[own], source, tmp_path / "program", *default_integer(other, source.suffix))
    assert f"passed INTEGER({other}) to INTEGER({own})" in words


@pytest.mark.parametrize(("own", "other"), [(4, 8), (8, 4)])
@pytest.mark.parametrize("optimisation", ["-O0", "-O2"])
def test_linker_refuses_c(libraries, tmp_path, own, other, optimisation):
    """Compiled with the flags for one library, linked to the other."""
    compiled = tmp_path / "program.o"
    run(["gcc", "-c", optimisation, *libraries[other].pkg_config("--cflags"), CONSUMERS["c"], "-o", compiled])
    done = subprocess.run(["gcc", compiled, *libraries[own].pkg_config("--libs")], capture_output=True, text=True)
    assert done.returncode != 0
    assert f"undefined reference to `jf_integers_have_{other}_bytes_'" in done.stderr


def test_program_that_opens_the_library_itself_needs_no_symbol(libraries, tmp_path):
    source = tmp_path / "program.c"
    source.write_text("#define JF_NO_LINK_CHECK\n#include <jointfrf.h>\nint main(void) { return JF_INFO_GOOD; }\n")
    run(["gcc", source, "-o", tmp_path / "program", *libraries[8].pkg_config("--cflags")])


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("-Dpython=true", "the Python package has integers of four bytes"),
        ("-Dfortran_args=-fdefault-integer-8", "leave out the option of the compiler"),
    ],
)
def test_build_refuses(tmp_path, option, message):
    meson = Path(sys.executable).parent / "meson"
    command = [meson, "setup", tmp_path, ROOT, option, "-Dilp64=true", "-Dlapack=scipy-openblas32"]
    done = subprocess.run([*command, f"-Dlapack_python={sys.executable}"], capture_output=True, text=True)
    assert done.returncode != 0
    assert message in done.stdout


def test_plug_ins_of_one_process_may_use_both(libraries, tmp_path):
    """The symbols have the same names: only their versions tell which library a plug-in means."""
    for n_bytes, library in libraries.items():
        (lib_dir,) = library.pkg_config("--variable=libdir")
        flags = [*library.pkg_config("--cflags", "--libs"), f"-Wl,-rpath,{lib_dir}"]
        plug_in = tmp_path / f"libplug{n_bytes}.so"
        run(["gcc", f"-Dmain=plug{n_bytes}", "-shared", "-fPIC", CONSUMERS["c"], "-o", plug_in, *flags])
    source = tmp_path / "host.c"
    source.write_text("int plug4(void), plug8(void);\nint main(void) { return plug4() || plug8(); }\n")
    for order in ("48", "84"):
        plug_ins = [f"-lplug{n_bytes}" for n_bytes in order]
        run(["gcc", source, "-o", tmp_path / "host", f"-L{tmp_path}", f"-Wl,-rpath,{tmp_path}", *plug_ins])
        run([tmp_path / "host"])


def test_exported_symbols(libraries):
    for n_bytes, library in libraries.items():
        (lib_dir,) = library.pkg_config("--variable=libdir")
        exported = run(["nm", "-D", "--defined-only", f"{lib_dir}/lib{library.name}.so"]).splitlines()
        expected = [f"{name}@@{library.name}_0".replace("have_4", f"have_{n_bytes}") for name in EXPORTED]
        assert [line.split()[-1] for line in exported if " A " not in line] == sorted(expected)


def test_one_prefix_holds_both(libraries):
    """Everything but the reference, which is one for both, has a place of its own."""
    prefix = libraries[8].prefix
    include = {path.relative_to(prefix).as_posix() for path in (prefix / "include").rglob("*") if path.is_file()}
    own = {path for path in include if path.startswith("include/jointfrf64/")}
    assert {path.replace("jointfrf64/", "", 1) for path in own if "/gcc-" not in path} == {
        "include/jointfrf.h",
        "include/jointfrf.inc",
    }
    assert {path.replace("jointfrf64/gcc", "jointfrf/gcc") for path in own if "/gcc-" in path} <= include
    for include_file in prefix.glob("include/**/jointfrf.inc"):
        assert max(map(len, include_file.read_text().splitlines())) <= 72
        assert "@" not in include_file.read_text()


# What the library makes of numbers that four bytes cannot hold.

#: Real arguments for which every routine does something; the others are zero.
NUMBERS = {"offset": [0.0, 1.0], "youngs_modulus": [1.0], "density": [1.0], "level": [0.1], "coordinates": [0.0] * 24}
NUMBERS |= {"share": [1.0], "spread_m": [1.0], "floor_shape": [1.0], "inflation": [1.0], "freq": [1.0]}
NUMBERS |= {"spring": [1.0], "variance": [1.0]}
LETTERS = {"equation": b"rs", "trans": b"N", "kind": b"N", "reference": b"E", "method": b"S", "formulation": b"R"}
#: Integer arguments that are not 1.
INTEGERS = {
    "m": 2,
    "reciprocal": 0,
    "kinds": 0,
    "n_correlated": 0,
    "kl": 0,
    "ku": 0,
    "first": 0,
    "lwork": 500,
    "liwork": 500,
}
#: Those that may have any value: of a seed the lower 32 bits count, and memory may be as long as it likes.
FREE = {"seed", "lwork", "liwork", "n_text"}
#: Arguments that are others in one routine.
OWN: dict[str, dict[str, Any]] = {
    "jf_estimate_noise_": {"first": 1},
    "jf_fit_joint_": {"n_row": 2, "n_column": 2},
    "jf_start_joint_": {"n_row": 2, "n_column": 2},
    "jf_noise_parts_": {"method": b"L"},
}
ROUTINES = {
    name: [argument.split() for argument in arguments]
    for name, arguments in prototypes().items()
    if name not in ("jf_version_", "jf_info_text_", "jf_line_text_", "jf_get_engine_")
}


def call(library: ctypes.CDLL, name: str, **integers: int) -> int:
    """Call a routine with the smallest arguments that are good; return its info."""
    memory, own = [], OWN.get(name, {})
    for *kind, pointer in ROUTINES[name]:
        argument = pointer.removeprefix("*")
        if "char" in kind:
            memory.append(ctypes.create_string_buffer(own.get(argument) or LETTERS[argument]))
        elif "jf_int" in kind:
            value = integers.get(argument, own.get(argument, INTEGERS.get(argument, 1)))
            memory.append((ctypes.c_int64 * 600)(value, *[1] * 3))
        else:
            memory.append((ctypes.c_double * 2000)(*NUMBERS.get(argument, [])))
    getattr(library, name)(*map(ctypes.byref, memory))
    return memory[-1][0]


@pytest.mark.parametrize("name", ROUTINES)
def test_long_integers_are_not_taken_for_short_ones(library64, name):
    assert call(library64, name) >= 0
    tried = 0
    for i, (*kind, pointer) in enumerate(ROUTINES[name], start=1):
        argument = pointer.removeprefix("*")
        if "const" in kind and "jf_int" in kind and argument not in FREE:
            short = OWN.get(name, {}).get(argument, INTEGERS.get(argument, 1))
            for value in (2**32 + short, 2**31, 2**62, short - 2**32):
                tried += 1
                assert call(library64, name, **{argument: value}) == -i, (argument, value)
    assert tried > 0


def test_lists_have_eight_bytes_an_entry(library64):
    n_freq, sentinel = 3, -(2**40) - 1
    n, lines, info = ctypes.c_int64(1), ctypes.c_int64(n_freq), ctypes.c_int64(sentinel)
    a, inverse, rcond = (ctypes.c_double * 6)(2.0, 0.0, 0.0, 0.0, 4.0), (ctypes.c_double * 6)(), (ctypes.c_double * 3)()
    line_info = (ctypes.c_int64 * 4)(*[sentinel] * 4)
    arguments = [n, lines, a, inverse, line_info, rcond]
    library64.jf_invert_(*map(ctypes.byref, [*arguments, info]))
    assert (info.value, list(line_info)) == (1, [0, 1, 0, sentinel])
    work, iwork, ask = (ctypes.c_double * 2)(), (ctypes.c_int64 * 2)(sentinel, sentinel), ctypes.c_int64(-1)
    library64.jf_invert_work_(*map(ctypes.byref, [*arguments, work, ask, iwork, ask, info]))
    assert (info.value, list(iwork)) == (0, [1, sentinel])


def test_seed_counts_by_its_lower_bits(library64):
    """Written as a negative number of four bytes, or as the positive one of eight."""
    results = []
    for seed in (-5, 2**32 - 5):
        polluted = (ctypes.c_double * 2)()
        text = [ctypes.create_string_buffer(letter) for letter in (b"N", b"C", b"E")]
        numbers = [ctypes.c_int64(0), ctypes.c_int64(1), ctypes.c_double(0.1), (ctypes.c_int64 * 2)(seed, 0)]
        sizes = [ctypes.c_int64(value) for value in (1, 1, 1, 0, 1)]
        h, info = (ctypes.c_double * 2)(3.0, 4.0), ctypes.c_int64(7)
        library64.jf_pollute_(*map(ctypes.byref, [*text, *numbers, *sizes, h, polluted, info]))
        assert info.value == 0
        results.append(complex(*polluted))
    assert results[0] == results[1] == complex(jf.pollute([[[3 + 4j]]], 0.1, "complex", seed=2**32 - 5)[0, 0, 0])
