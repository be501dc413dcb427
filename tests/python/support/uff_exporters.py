"""Universal Files as programs export them, each form with where it was seen.

Every form holds one measurement: accelerances of two responses and one hammer, five lines. The layout (line ends,
padding, letters of exponents, order and content of headers, form of the numbers) is that of the source; where the
file of the source is a time history or holds no measurement of forces, records 6 to 10 are those of FRFs. Sources:

definition   SDRC's definitions of datasets 58, 151, 164, 15 and 2411 and the one of 58b by the Structural Dynamics
             Research Laboratory, University of Cincinnati (byte ordering 1 and 2; floating-point formats DEC VMS,
             IEEE 754, IBM; "no CR/LF characters embedded in or following the binary data")
pyuff        files of measurement programs among the test data of pyuff (github ladisk/pyuff, folder data)
issue 38     github ladisk/pyuff: a program whose 58b counts a line end after the numbers among their bytes
NI           manual of the Sound and Vibration Toolkit for LabVIEW, SV UFF58 Format ASCII Header
catman       HBM catman, which names itself in record 2 of pyuff's time-history-not-all-columns-filled.uff

No file of B&K PULSE and BK Connect, ME'scope, Data Physics, Dewesoft and Polytec was found: nothing is said of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

__all__ = ["COHERENCE", "EXPORTERS", "FREQ_HZ", "REFUSED", "VALUES", "Form", "function", "in_single"]

FREQ_HZ = np.arange(10.0, 60.0, 10.0)
#: Two responses at one excitation.
VALUES = np.array([[1.25 - 2.5j, -3.0 + 0.5j, 0.75 + 0.0625j, -0.1 - 0.2j, 6.5e-3 + 1j],
                   [2.0 + 1.0j, -0.5 - 4.0j, 8.0 - 0.25j, 0.3 + 0.6j, -7.5e-2 - 2j]])  # fmt: skip
COHERENCE = np.array([0.5, 0.75, 1.0, 0.875, 0.9375])
_NODES = (101, 102)


@dataclass(frozen=True)
class Form:
    """How a program writes dataset 58."""

    binary: bool = False
    big_endian: bool = False
    floating_point: int = 2
    double: bool = False
    uneven: bool = False
    line_end: str = "\n"
    padded: bool = False  #: records of 80 columns, delimiters too
    exponent: str = "E+00"  #: E+00, e+00, E+000 (of older Windows compilers), D+00
    ends_with: bytes = b""  #: between binary numbers and the delimiter
    counted_end: bool = False  #: whether that is among the bytes stated
    encoding: str = "latin-1"
    id_lines: tuple[str, ...] = ("NONE",) * 5
    units: tuple[str, str] = ("m/s^2", "N")
    types: tuple[int, int] = (12, 13)
    abscissa: tuple[int, str] = (18, "Hz")
    entity: str = "NONE"

    def number(self, value: float, width: int, digits: int) -> str:
        text = f"{value:.{digits}E}"
        if self.exponent == "E+000":
            text = text[:-2] + "0" + text[-2:]
        return text.replace("E", self.exponent[0]).rjust(width)

    def lines(self, records: list[str]) -> bytes:
        return "".join((line.ljust(80) if self.padded else line) + self.line_end for line in records).encode(
            self.encoding
        )


def in_single(values: np.ndarray) -> np.ndarray:
    """Return numbers as single precision holds them."""
    return values.astype("c8" if np.iscomplexobj(values) else "f4").astype(values.dtype)


def function(
    form: Form,
    values: np.ndarray,
    response: int,
    *,
    kind: int = 4,
    version: int = 0,
    direction: int = 3,
    reference: int = 101,
) -> bytes:
    """Write one function as dataset 58 or 58b."""
    is_complex = np.iscomplexobj(values)
    number_type = (6 if is_complex else 4) if form.double else (5 if is_complex else 2)
    place = f" {form.entity:<10}{response:10d}{direction:4d} {form.entity:<10}{reference:10d}{3:4d}"
    first, step = (0.0, 0.0) if form.uneven else (FREQ_HZ[0], FREQ_HZ[1] - FREQ_HZ[0])
    axes = [(form.types[0], "Response", form.units[0]), (form.types[1], "Force", form.units[1])]
    if kind != 4:
        axes = [(0, "Coherence", "NONE"), (0, "NONE", "NONE")]
    records = [
        *form.id_lines,
        f"{kind:5d}{0:10d}{version:5d}{0:10d}{place}",
        f"{number_type:10d}{values.size:10d}{0 if form.uneven else 1:10d}"
        + "".join(form.number(each, 13, 5) for each in (first, step, 0.0)),
        *(f"{t:10d}{0:5d}{0:5d}{0:5d} {name:<20} {unit:<20}" for t, name, unit in
          [(*form.abscissa[:1], "Frequency", form.abscissa[1]), *axes, (0, "NONE", "NONE")]),
    ]  # fmt: skip
    if not form.binary:
        return form.lines(["    -1", "    58", *records, *_text(form, values), "    -1"])
    data = _binary(form, values)
    n_bytes = len(data) + (len(form.ends_with) if form.counted_end else 0)
    order = 2 if form.big_endian else 1
    kind_line = f"    58b{order:6d}{form.floating_point:6d}{11:12d}{n_bytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return form.lines(["    -1", kind_line, *records]) + data + form.ends_with + form.lines(["    -1"])


def _binary(form: Form, values: np.ndarray) -> bytes:
    order = ">" if form.big_endian else "<"
    size = 8 if form.double else 4
    if form.uneven:
        parts = np.ascontiguousarray(values).view(np.float64).reshape(values.size, -1)
        kinds = [("x", f"{order}f4"), ("v", f"{order}f{size}", (parts.shape[1],))]
        rows = np.zeros(values.size, kinds)
        rows["x"], rows["v"] = FREQ_HZ, parts
        return rows.tobytes()
    kind = "c" if np.iscomplexobj(values) else "f"
    return values.astype(f"{order}{kind}{size * (2 if kind == 'c' else 1)}").tobytes()


def _text(form: Form, values: np.ndarray) -> list[str]:
    """Record 12 by the table of the definition: 6E13.5, 4E20.12, and with an abscissa E13.5, 2E20.12."""
    width, digits, a_line = (20, 11, 4) if form.double else (13, 5, 6)
    numbers = [form.number(each, width, digits) for each in np.ascontiguousarray(values).view(np.float64)]
    if form.uneven:
        n = len(numbers) // values.size
        cells = [form.number(f, 13, 5) + "".join(numbers[n * i : n * i + n]) for i, f in enumerate(FREQ_HZ)]
        a_line = max(1, (6 if not form.double else 3) // (n + 1))
        return ["".join(cells[i : i + a_line]) for i in range(0, len(cells), a_line)]
    return ["".join(numbers[i : i + a_line]) for i in range(0, len(numbers), a_line)]


def _pair(form: Form, **more: object) -> bytes:
    return b"".join(function(form, VALUES[i], node, **more) for i, node in enumerate(_NODES))  # type: ignore[arg-type]


def _dataset(form: Form, kind: int, *records: str) -> bytes:
    return form.lines(["    -1", f"{kind:6d}", *records, "    -1"])


_PLAIN = Form()
_TESTLAB = Form(padded=True, exponent="E+00", units=("m/s2", "N"), id_lines=(
    "Harmonic FRF", "bar", "11-Oct-17 09:34:21", "H1", "NONE"))  # fmt: skip


def _testlab() -> bytes:
    """LMS Test.Lab: pyuff, TestLab 161 164 18 15 82.uff: delimiters of 80 columns for sets 151 and 164, then of 6."""
    plain = replace(_TESTLAB, padded=False)
    head = _dataset(_TESTLAB, 151, "AME_Test", "NONE", "LMS Test.Lab Rev project-15A", "11-Oct-17 09:34:21",
                    "11-Oct-17 09:34:21", "LMS Test.Lab Rev project-15A", "17-Oct-17 13:50:13 ")  # fmt: skip
    one, zero = "  1.00000000000000000D+00" * 3, " -2.73149999999999960D+02"
    head += _dataset(_TESTLAB, 164, "         9USER_DEFINED", one, zero)
    systems = ["         1         0         0         8         1", "SYS1",
               " -2.40000e+00 -9.50000e-01  0.00000e+00 -1.40000e+00 -9.50000e-01  0.00000e+00",
               " -1.40000e+00 -9.50000e-01  1.00000e+00"]  # fmt: skip
    nodes = [f"{node:10d}{0:10d}{0:10d}{8:10d}{x:13.5e}{0.0:13.5e}{0.0:13.5e}" for node, x in ((101, 0.5), (102, 1.5))]
    return head + _dataset(plain, 18, *systems) + _dataset(plain, 15, *nodes) + _pair(plain)


def _averaged() -> bytes:
    """H1 and coherence of each pair, one after the other, as record 6 of the definition tells them apart."""
    form = Form(id_lines=("H1", "NONE", "18-Apr-16 13:49:58", "NONE", "NONE"), double=True)
    coherence = replace(form, id_lines=("Coherence", *form.id_lines[1:]))
    return b"".join(
        function(form, VALUES[i], node) + function(coherence, COHERENCE, node, kind=6) for i, node in enumerate(_NODES)
    )


def _mm_and_inches() -> bytes:
    """Dataset 164 of pyuff's heat_engine_housing.uff (code 5, mm, no text): no labels, so it gives the units."""
    form = Form(units=("NONE", "NONE"))
    units = _dataset(form, 164, "         5                             2",
                     "    1.000000000000000E+03    1.000000000000000E+03    1.000000000000000E+00",
                     "    2.731500000000000E+02")  # fmt: skip
    return units + b"".join(function(form, VALUES[i], node) for i, node in enumerate(_NODES))


#: Files that are read, by form. A text of "single" holds five digits after the first.
EXPORTERS: dict[str, Callable[[], bytes]] = {
    # definition
    "text single": lambda: _pair(Form()),
    "text double": lambda: _pair(Form(double=True)),
    "text uneven single": lambda: _pair(Form(uneven=True)),
    "text uneven double": lambda: _pair(Form(uneven=True, double=True)),
    "58b little-endian single": lambda: _pair(Form(binary=True)),
    "58b little-endian double": lambda: _pair(Form(binary=True, double=True)),
    "58b big-endian single": lambda: _pair(Form(binary=True, big_endian=True)),
    "58b big-endian double": lambda: _pair(Form(binary=True, big_endian=True, double=True)),
    "58b uneven single": lambda: _pair(Form(binary=True, uneven=True)),
    "58b uneven big-endian": lambda: _pair(Form(binary=True, uneven=True, big_endian=True)),
    "H1 and coherence": _averaged,
    "several functions of a pair": lambda: (
        function(_PLAIN, VALUES[0], 101, kind=2) + _pair(_PLAIN) + function(_PLAIN, 2 * VALUES[0], 101, version=1)
    ),
    # LMS Test.Lab, by pyuff's file
    "LMS Test.Lab": _testlab,
    # pyuff, MPSTD#Set001_2024_10_08_10_27_07.uff: CR LF, and once more after the numbers; "1+Z" as entity
    "58b with line ends of Windows": lambda: _pair(Form(
        binary=True, line_end="\r\n", ends_with=b"\r\n", entity="1+Z", units=("m/s2", "N"),
        id_lines=("MPS set1 Dof1", "NONE", "08-Oct-24 10:27:07", "NONE", "NONE"))),
    # pyuff, Sample_UFF58b_bin.uff: CR LF in the text, the delimiter right after the numbers
    "58b, delimiter right after the numbers": lambda: _pair(Form(
        binary=True, line_end="\r\n", id_lines=("Mic 01.0Scalar", "NONE", "18-Apr-16 13:49:58", "NONE", "NONE"))),
    # pyuff, binary8byte.uff: the same in double precision, records of 80 columns, small letters of exponents
    "58b of records of 80 columns": lambda: _pair(Form(
        binary=True, double=True, line_end="\r\n", padded=True, exponent="e+00")),
    # issue 38
    "58b that counts its line end": lambda: _pair(Form(
        binary=True, double=True, ends_with=b"\n", counted_end=True)),
    # catman
    "HBM catman": lambda: _pair(Form(
        padded=True, exponent="E+000", encoding="utf-8", units=("m/s²", "N"), types=(1, 13),
        id_lines=("1x : m/s²", "UFF58 file created by HBM catman", "30-Apr-20 19:12:52", "NONE", "NONE"))),
    # pyuff, dataset_milestone_in_header.uff: delimiters of 80 columns, empty records of 80 blanks
    "delimiters of 80 columns": lambda: _pair(Form(
        padded=True, id_lines=("M.REDON", "", "07-Dec-17 14:38:01", "", ""))),
    # pyuff, sample_dataset58_psd.uff (VibControl): abscissa "Hz" of an unknown data type, uneven, units in Latin-1
    "VibControl": lambda: _pair(Form(
        uneven=True, abscissa=(0, "Hz"), units=("m/s²", "N"),
        id_lines=("FRF", "VibControl Random", "13-Apr-23 09:57:51", "Channel 1", "NONE"))),
    # pyuff, non_ascii_header.uff: one label for the whole ratio, numerator of general type
    "one label for the ratio": lambda: _pair(Form(
        exponent="e+00", units=("(1/N)*(m/s²)", "NONE"), types=(1, 0),
        id_lines=("ref6_23_Mar".ljust(80), "NONE", "23-Mar-17 19:02:23", "Record 1 of Dataset no 58",
                  "H1 : #  2 / #  1"))),
    # NI
    "NI Sound and Vibration Toolkit": lambda: _pair(Form(
        id_lines=("Frequency response".ljust(80), "NONE".ljust(80), "18-04-16 13:49:58".ljust(80), "NONE".ljust(80),
                  "NONE".ljust(80)))),
    "dataset 164 in mm": _mm_and_inches,
}  # fmt: skip
#: Files that are refused, and with what words.
REFUSED: dict[str, tuple[Callable[[], bytes], str]] = {
    # definition of 58b
    "58b of DEC VMS": (lambda: _pair(Form(binary=True, floating_point=1)), "not IEEE 754"),
    "58b of IBM": (lambda: _pair(Form(binary=True, floating_point=3)), "not IEEE 754"),
    "real values": (lambda: function(Form(), VALUES[0].real, 101), "real numbers, without phase"),
    # pyuff, non_ascii_header.uff
    "no nodes": (lambda: function(Form(), VALUES[0], 0, direction=0, reference=0), "names no response node"),
    # pyuff, sample_dataset58_psd.uff
    "power spectral densities": (
        lambda: function(replace(_PLAIN, uneven=True), VALUES[0], 0, kind=9), "1 power spectral density"),
    "coherence alone": (lambda: function(Form(), COHERENCE, 101, kind=6), "1 coherence"),
}  # fmt: skip
