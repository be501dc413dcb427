"""What the build generates from api.F90: header, include file, signatures, forms in memory of the caller, reference."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from abi import SPELT, prototypes
from generate import signatures
from generate.__main__ import main
from generate.reader import read_api
from generate.source import Source

ROOT = Path(__file__).resolve().parents[3]
API = ROOT / "fortran" / "api"
VALUES = [ROOT / "fortran" / name for name in ("status.f90", "engine.F90")]
TEXT = (API / "api.F90").read_text()
OUTPUTS = {
    "header": "jointfrf.h", "include": "jointfrf.inc", "work": "api_work.F90", "signatures": "_kernel.pyf",
    "symbols": "symbols.c",
}  # fmt: skip


def generate(folder: Path, text: str = TEXT, what=(*OUTPUTS, "reference"), *options: str) -> dict[str, str]:
    """Return all that is generated from a text of api.F90, by the names of the files."""
    source, output = folder / "api.F90", folder / "output"
    source.write_text(text)
    output.mkdir(exist_ok=True)
    for name in what:
        arguments = [name, "--output", str(output / OUTPUTS.get(name, "")), *options]
        if name in ("header", "include"):
            arguments += ["--template", str(API / "include" / f"{OUTPUTS[name]}.in")]
        assert main([*arguments, str(source), *map(str, VALUES)]) == 0
    return {path.name: path.read_text() for path in output.iterdir()}


def replaced(*pairs: tuple[str, str]) -> str:
    """Return api.F90 with passages replaced, each of which stands there once."""
    text = TEXT
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, str]:
    return generate(tmp_path_factory.mktemp("api"))


def test_header_declares_the_listed_abi(files):
    assert prototypes(files["jointfrf.h"]) == prototypes()
    assert re.findall(r"^#define (jf_\w+) \1_$", files["jointfrf.h"], re.MULTILINE) == [
        name[:-1] for name in prototypes(files["jointfrf.h"])
    ]


def test_constants_are_those_of_the_kernel(files):
    constants = dict(re.findall(r"^#define (JF_\w+) \(?(-?\d+)\)?$", files["jointfrf.h"], re.MULTILINE))
    include = files["jointfrf.inc"]
    assert dict(re.findall(r"^ {6}PARAMETER \((\w+) = (-?\d+)\)$", include, re.MULTILINE)) == constants
    assert re.findall(r"^ {6}INTEGER (JF_\w+)$", include, re.MULTILINE) == list(constants)
    assert max(map(len, include.splitlines())) <= 72
    declared = " ".join(
        re.findall(r"parameter, public :: (.*)$", "".join(path.read_text() for path in VALUES), re.MULTILINE)
    )
    kernel = dict(re.findall(r"\b((?:info|line|engine)_\w+) = (-?\d+)", declared))
    assert {f"jf_{name}".replace("engine_v", "engine_x86_64_v").upper(): kernel[name] for name in kernel} == constants


def test_other_symbols_hand_over_the_arguments_of_each_routine(files):
    found = re.findall(r"^void (jf_\w+)\((.*)\) \{ (jf_\w+_)\((.*)\); \}$", files["symbols.c"], re.MULTILINE)
    assert sorted(name for name, *_ in found) == sorted(SPELT)
    listed = prototypes()
    for _, declared, called, passed in found:
        assert declared.split(", ") == listed[called]
        assert passed.split(", ") == [argument.rpartition("*")[2] for argument in listed[called]]


@pytest.mark.parametrize(
    ("n_bytes", "library", "other", "other_bytes"),
    [("4", "jointfrf", "jointfrf64", 8), ("8", "jointfrf64", "jointfrf", 4)],
)
def test_include_file_names_its_library(tmp_path, n_bytes, library, other, other_bytes):
    include = generate(tmp_path, TEXT, ["include"], "--integer-bytes", n_bytes)["jointfrf.inc"]
    assert include.startswith(f"! {library}: ")
    assert f"the library {other} instead" in include
    assert (
        f"      INTERFACE JF_INTEGERS_HAVE_{other_bytes}_BYTES\n        SUBROUTINE JF_LINK_{other.upper()}(I)\n"
        in include
    )


def test_signatures_hide_trans_and_take_its_shapes(files):
    pyf = files["_kernel.pyf"]
    assert pyf.count("character*1, intent(hide) :: trans = 'T'") == TEXT.count("kind=c_char), intent(in) :: trans")
    assert pyf.count("threadsafe") == pyf.count("end subroutine")
    solve = pyf.split("end subroutine jf_solve")[0].split("subroutine jf_solve(")[1]
    for name, intent in (("b", "in"), ("x", "inout")):
        assert (
            f"""  complex*16, dimension(n_rhs, n, n_freq), intent({intent}), &
    check(shape({name}, 0) == n_rhs && shape({name}, 1) == n && shape({name}, 2) == n_freq) :: {name}
"""
            in solve
        )
    assert "integer, intent(hide) :: n_text = 80\n  character*80, intent(out) :: text\n" in pyf
    assert "character*2, intent(in) :: equation\n" in pyf
    assert "dimension(kl + ku + 1, max(n_structural, 1)), intent(in)" in pyf
    assert "dimension(n*n, n*n, n_freq), intent(inout)" in pyf
    assert "real*8, intent(in) :: loss_factor\n" in pyf
    assert "_work" not in pyf


def test_every_array_is_checked_in_every_dimension(files):
    for declaration in re.findall(r"dimension\(.*\n(?:.*&\n)*.* :: \w+$", files["_kernel.pyf"], re.MULTILINE):
        dimensions = re.match(r"dimension\((.*)\), intent", declaration)[1]
        name = declaration.split()[-1]
        checks = re.findall(rf"shape\({name}, (\d)\) == (.+?)(?: && | &&|\) ::)", declaration.replace("&\n    ", ""))
        assert [int(i) for i, _ in checks] == list(range(len(checks)))
        assert ", ".join(text for _, text in checks) == dimensions


def test_work_forms_number_their_arguments(files):
    """The number that AS_MEMORY takes is the place of LWORK, and the call has it after INFO."""
    listed = {name: arguments for name, arguments in prototypes(files["jointfrf.h"]).items() if "_work_" in name}
    forms = files["api_work.F90"].split("  subroutine ")[1:]
    assert [f"{form.split('(')[0]}_" for form in forms] == list(listed)
    for form, arguments in zip(forms, listed.values(), strict=True):
        place = arguments.index("const jf_int *lwork") + 1
        assert re.search(rf"info, (?:&\n *)?as_memory\({place}_ip, work, lwork, iwork, liwork\)\)", form)
    assert max(map(len, files["api_work.F90"].splitlines())) <= 120


ADDED = [
    ("  subroutine jf_modify(trans, n, n_m,", "  subroutine jf_modify(trans, added, n, n_m,"),
    (
        "  !> n_m     number of modified DOFs\n",
        "  !> n_m     number of modified DOFs\n  !> added   weights, shape (n, 2), or (2, n) with trans 'T'\n",
    ),
    (
        "    complex(c_double_complex), target, intent(in) :: alpha(n, n, n_freq), d(min",
        "    real(c_double), intent(in) :: added(*)\n"
        "    complex(c_double_complex), target, intent(in) :: alpha(n, n, n_freq), d(min",
    ),
]


def test_an_added_argument_appears_in_all_outputs(files, tmp_path):
    new = generate(tmp_path, replaced(*ADDED))
    expected = ["const char *trans", "const double *added", "const jf_int *n"]
    for name in ("jf_modify_", "jf_modify_work_"):
        assert prototypes(new["jointfrf.h"])[name][:3] == expected
    signature = new["_kernel.pyf"].split("subroutine jf_modify(")[1]
    assert signature.startswith("trans, added, n, ")
    assert (
        "real*8, dimension(2, n), intent(in), &\n    check(shape(added, 0) == 2 && shape(added, 1) == n)" in signature
    )
    form = new["api_work.F90"].split("subroutine jf_modify_work(")[1]
    assert form.startswith("trans, added, n, ")
    assert "    real(c_double), intent(in) :: added(*)\n" in form
    assert "as_memory(13_ip, work" in form
    for page in ("jf_modify.3", "jf_modify_work.3"):
        assert '.BR added " (in, DOUBLE PRECISION (*))"\nweights, shape (n, 2)' in new[page]
    assert "- `added` (in, DOUBLE PRECISION `(*)`): weights" in new["jointfrf.md"]
    changed = {name for name in new if new[name] != files[name]}
    generated = {"jointfrf.h", "symbols.c", "_kernel.pyf", "api_work.F90"}
    assert changed == {*generated, "jf_modify.3", "jf_modify_work.3", "jointfrf.md"}


ROUTINE = """
  !> Inverse of every line, scaled.
  !> n           order of the matrices
  !> scale       factor of the inverse
  !> a           shape (n, n, n_freq)
  !> a_inverse   shape (n, n, n_freq)
  subroutine jf_scaled_inverse(n, n_freq, scale, a, a_inverse, line_info, rcond, info) &
    bind(C, name='jf_scaled_inverse_')
    integer(ip), intent(in) :: n, n_freq
    real(c_double), intent(in) :: scale
    complex(c_double_complex), target, intent(in) :: a(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: a_inverse(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info

    call invert(a, a_inverse, line_info, rcond, info)
    a_inverse = scale * a_inverse
  end subroutine jf_scaled_inverse
"""


def test_an_added_routine_appears_in_all_outputs(files, tmp_path):
    names, end = "  public :: jf_invert, jf_solve\n", "  end subroutine jf_invert\n"
    public = f"{names}  public :: jf_scaled_inverse, jf_scaled_inverse_work\n"
    new = generate(tmp_path, replaced((names, public), (end, end + ROUTINE)))
    calls = prototypes(new["jointfrf.h"])
    for form in ("", "work_"):
        arguments = list(calls[f"jf_invert_{form}"])
        arguments.insert(2, "const double *scale")
        assert calls[f"jf_scaled_inverse_{form}"] == arguments
    signature = new["_kernel.pyf"].split("subroutine jf_scaled_inverse(")[1].split("end subroutine")[0]
    assert "real*8, intent(in) :: scale" in signature
    form = new["api_work.F90"].split("subroutine jf_scaled_inverse_work(")[1]
    assert form.startswith("n, n_freq, scale, a, ")
    assert ".BR scale" in new["jf_scaled_inverse.3"]
    assert "- `scale` (in, DOUBLE PRECISION): factor of the inverse" in new["jointfrf.md"]
    assert {name for name in new if name not in files} == {"jf_scaled_inverse.3", "jf_scaled_inverse_work.3"}
    changed = {name for name in files if new[name] != files[name]}
    assert changed == {"jointfrf.h", "symbols.c", "_kernel.pyf", "api_work.F90", "jointfrf.3", "jointfrf.md"}


def test_an_added_constant_appears_in_header_and_include_file(files, tmp_path):
    line = "  integer(ip), parameter, public :: jf_line_overflow = line_overflow\n"
    new = generate(tmp_path, replaced((line, line + line.replace("jf_line_overflow", "jf_line_other"))))
    assert "#define JF_LINE_OTHER (-2)\n" in new["jointfrf.h"]
    assert "      PARAMETER (JF_LINE_OTHER = -2)\n" in new["jointfrf.inc"]
    assert {name for name in new if new[name] != files[name]} == {"jointfrf.h", "jointfrf.inc"}


def test_preprocessor_lines_of_a_body_are_taken_over(tmp_path):
    call = "      call modify(is_transposed(trans), alpha, d, dofs, gamma, line_info, rcond, info)\n"
    work = generate(tmp_path, replaced((call, f"#ifdef SOME\n{call}#endif\n")), ["work"])["api_work.F90"]
    assert re.search(r"\n#ifdef SOME\n      call modify\(.*&\n.*\n#endif\n", work)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("  !> n_m     number of modified DOFs\n", "", "subroutine jf_modify(",
         "jf_modify: no comment explains argument n_m: write '!> n_m   what it is, shape (...), unit'"),
        ("  !> n_m     number of modified", "  !> n_m number of modified", "subroutine jf_modify(",
         "jf_modify: no comment explains argument n_m: write '!> n_m   what it is, shape (...), unit'"),
        ("  !> n_m     number of modified DOFs\n", "  !> n_m     as in jf_couple\n", "  !> n_m     as in jf_couple",
         "jf_modify: no comment explains argument n_m: write"),
        ("  !> n_m     number of modified DOFs\n", "  !> n_m     number\n  !> n_q     number\n", "  !> n_q     number",
         "jf_modify has no argument n_q: take it out of the comment"),
        ("added at the modified DOFs, shape (n_m, n_m, n_freq)", "put on", "put on",
         "jf_modify: the comment of d does not give its shape: write 'shape (n_m, n_m, n_freq)'"),
        ("added at the modified DOFs, shape (n_m, n_m, n_freq)", "shape (n_m, n, n_freq)", "shape (n_m, n, n_freq)",
         "jf_modify: the comment of d says shape (n_m, n, n_freq), its declaration (n_m, n_m, n_freq)"),
        ("added at the modified DOFs, shape (n_m, n_m, n_freq)", "shape (n_m, n_m, n_q)", "shape (n_m, n_m, n_q)",
         "jf_modify: the comment of d says shape (n_m, n_m, n_q), its declaration (n_m, n_m, n_freq)"),
        ("  !> n_m     number of modified DOFs", "  !> n_m     number, shape (2)", "  !> n_m     number, shape",
         "jf_modify: the comment of n_m gives a shape, but no array is declared: declare n_m(2)"),
        ("  !> b, x    shape (n, n_rhs, n_freq), or (n_rhs, n, n_freq)", "  !> b, x    shape (n, n_q), or (n_q, n)",
         "  !> b, x    shape", "jf_solve: the comment of b gives a shape with n_q, which is no integer argument"),
        ("    integer(ip), target, intent(in) :: dofs(n_m)\n", "", "subroutine jf_modify(",
         "jf_modify: argument dofs is not declared: write its type and intent"),
        ("    integer(ip), target, intent(in) :: dofs(n_m)", "    integer, target, intent(in) :: dofs(n_m)",
         "    integer, target", "jf_modify: the type of an argument must be one of integer(ip), real(c_double)"),
        ("    integer(ip), target, intent(in) :: dofs(n_m)", "#ifdef X\n    integer(ip), intent(in) :: dofs(n_m)",
         "#ifdef X", "jf_modify: no preprocessor line may stand among declarations"),
        ("n_m, n_freq, alpha, d, dofs, gamma, line_info, rcond, info) bind(C, name='jf_modify_')",
         "n_m, n_freq, alpha, &\n#ifdef X\n d, dofs, gamma, line_info, rcond, info) bind(C, name='jf_modify_')",
         "#ifdef X", "no preprocessor line may stand within a statement"),
        ("info) bind(C, name='jf_modify_')", "info)", "subroutine jf_modify(",
         "jf_modify is no name in C: write \"bind(C, name='jf_modify_')\" after its arguments"),
        ("  !> Receptance of a locally modified structure. Eqs. (2.34)-(2.36).\n", "", "subroutine jf_modify(",
         "jf_modify: nothing says what it does: write a sentence after '!>' above it"),
        ("  end subroutine jf_modify\n", "", "subroutine jf_modify(",
         "jf_modify has no end: write 'end subroutine jf_modify'"),
        ("d, dofs, gamma, line_info, rcond, info)\n    end if", "d, dofs, gamma, line_info, rcond)\n    end if",
         "subroutine jf_modify(",
         "jf_modify: write one call whose last argument is info, not 0: jf_modify_work adds the memory to it"),
        ("  public :: jf_transform_work", "  public :: jf_transfer_work", "  public :: jf_transfer_work",
         "jf_transfer_work is public, but there is no such routine: write it, or take the name out"),
        ("  public :: jf_transform_work", "  public :: jf_pollute_work", "  public :: jf_pollute_work",
         "jf_pollute_work: take the name out, for jf_pollute has no line_info, rcond and info"),
        ("!> lwork       length", "!>\n!> length", "!> The flat API",
         "the head does not explain argument lwork of jf_invert_work: write '!> lwork   what it is'"),
        ("jf_line_good = line_good", "jf_line_good = line_bad", "jf_line_good = line_bad",
         "jf_line_good: no source declares the value of line_bad"),
        ("  use jointfrf_ismm, only: inverse_substructuring, ismm\n", "  use jointfrf_ismm\n", "  use jointfrf_ismm",
         "write what is taken: 'use jointfrf_ismm, only: ...'"),
    ],
)  # fmt: skip
def test_what_breaks_a_convention_fails_with_one_sentence(tmp_path, capsys, old, new, line, message):
    text = replaced((old, new))
    source = tmp_path / "api.F90"
    source.write_text(text)
    assert main(["work", "--output", str(tmp_path / "work"), str(source), *map(str, VALUES)]) == 1
    (number,) = (i for i, there in enumerate(text.splitlines(), start=1) if line in there)
    printed = capsys.readouterr().err
    assert printed.startswith(f"api.F90:{number}: {message}")
    assert len(printed.splitlines()) == 1
    assert not (tmp_path / "work").exists()


def test_a_file_that_would_not_change_is_not_written(tmp_path):
    generate(tmp_path)
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "output").iterdir()}
    generate(tmp_path, TEXT.replace("!> Inverse of every line.", "!> The inverse of every line."))
    changed = {path.name for path, time in before.items() if path.stat().st_mtime_ns != time}
    assert changed == {"jf_invert.3", "jointfrf.3", "jointfrf.md"}


def test_the_command_needs_nothing_but_the_standard_library(tmp_path):
    command = [sys.executable, "-I", "-S", "-c", f"import sys; sys.path.insert(0, {str(API)!r}); import runpy; "
               "runpy.run_module('generate', run_name='__main__')"]  # fmt: skip
    done = subprocess.run([*command, "names", API / "api.F90", *VALUES], capture_output=True, text=True, check=True)
    assert [f"{name}_" for name in done.stdout.split()] == list(prototypes(generate(tmp_path)["jointfrf.h"]))


SMALL = """!> Head.
!> n_freq   number of lines.
!> Tail.
module jointfrf
  public :: jf_one, jf_two

contains

  !> Does one thing. And more.
  !> a, b    two numbers, shape (n_freq, 2 n, n^2), or (2 n,
  !>         n_freq, n^2) with trans 'T', m
  !> n_freq  as above; not 0
  !> n       a size
  !> c       one, same shape
  subroutine jf_one(n_freq, n, &
                    ! a remark within the statement

                    a, b, c) &
    bind(C, name='jf_one_')
    integer(ip), intent(in) :: n_freq, n
    real(c_double), target, intent(in) :: a(*), b(*)
    real(c_double), intent(in) :: c(*)   ! intent(out) :: d
  end subroutine jf_one

  !> Does another.
  !> n_freq, n  as in jf_one; a word more
  !> b          shape (1 + 2 n, n_freq)
  subroutine jf_two(n, n_freq, b) bind(C, name='jf_two_')
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), intent(out) :: b(2_long*n + 1, min(n_freq, n))
  end subroutine jf_two
end module jointfrf
"""


def test_comments_are_read():
    api = read_api(Source("small.F90", tuple(SMALL.splitlines())))
    one, two = api.routines
    assert (one.summary, one.prose, api.prose) == ("Does one thing", "Does one thing. And more.", ["Head.", "Tail."])
    words = "two numbers, shape (n_freq, 2 n, n^2), or (2 n, n_freq, n^2) with trans 'T', m"
    plain, transposed = ("n_freq", "2*n", "n*n"), ("2*n", "n_freq", "n*n")
    assert [(a.name, a.shape, a.transposed, a.text) for a in one.arguments] == [
        ("n_freq", (), (), "number of lines; not 0"),
        ("n", (), (), "a size"),
        ("a", plain, transposed, words),
        ("b", plain, transposed, words),
        ("c", plain, transposed, "one, same shape"),
    ]
    assert [a.text for a in two.arguments[:2]] == ["a size; a word more", "number of lines; not 0; a word more"]
    assert (two.arguments[2].intent, two.arguments[2].shape) == ("out", ("1 + 2*n", "n_freq"))
    assert "dimension(1 + 2*n, n_freq), intent(inout), &\n    check(shape(b, 0) == 1 + 2*n &&" in signatures.write(api)
