"""Units of files: what labels and headings mean, in any spelling; right values or an error, never wrong values."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from frf_files import FREQ_HZ, frf_set, names, write_mat
from jointfrf.errors import FileContentError
from jointfrf.io import read_frfs, write_hdf5, write_npz
from jointfrf.io.units import StatedUnits, parse_frequency_unit, parse_level, parse_phase_unit, parse_unit
from shared_data import shared_data
from uff_writer import VALUES, function

POUND, GRAVITY, INCH = 4.4482216152605, 9.80665, 0.0254


@pytest.mark.parametrize(
    ("label", "to_si", "exponents"),
    [
        ("m/s/s", 1.0, (1, 0, -2)),
        ("M/SEC**2", 1.0, (1, 0, -2)),
        ("m s-2", 1.0, (1, 0, -2)),
        ("m·s^-2", 1.0, (1, 0, -2)),
        ("m·s⁻²", 1.0, (1, 0, -2)),
        ("m/(N s2)", 1.0, (1, -1, -2)),
        ("[(m/s²)/N]", 1.0, (1, -1, -2)),
        ("m per N", 1.0, (1, -1, 0)),
        ("1/kg", 1.0, (1, -1, -2)),
        ("\u00b5m", 1e-6, (1, 0, 0)),
        ("\u03bcm", 1e-6, (1, 0, 0)),
        ("\u00c2\u00b5m", 1e-6, (1, 0, 0)),
        ("micron/kN", 1e-9, (1, -1, 0)),
        ("Micrometers", 1e-6, (1, 0, 0)),
        ("mils", 1e-3 * INCH, (1, 0, 0)),
        ("inches/s^2", INCH, (1, 0, -2)),
        ("in./sec.^2", INCH, (1, 0, -2)),
        ("ft", 12 * INCH, (1, 0, 0)),
        ("lb-in", POUND * INCH, (1, 1, 0)),
        ("N.m", 1.0, (1, 1, 0)),
        ("deg/s", np.pi / 180, (0, 0, -1)),
        ("g's", GRAVITY, (1, 0, -2)),
        ("g\u2019s/lbf", GRAVITY / POUND, (1, -1, -2)),
        ("mg/N", 1e-3 * GRAVITY, (1, -1, -2)),
        ("MN", 1e6, (0, 1, 0)),
        ("KN", 1e3, (0, 1, 0)),
        ("LBF", POUND, (0, 1, 0)),
        ("in/lb (force)", INCH / POUND, (1, -1, 0)),
        ("(in/lbf)", INCH / POUND, (1, -1, 0)),
        ("mil/kips", 1e-6 * INCH / POUND, (1, -1, 0)),
        ("mm/kgf", 1e-3 / GRAVITY, (1, -1, 0)),
        ("10³ N", 1e3, (0, 1, 0)),
        ("10^-6 m/N", 1e-6, (1, -1, 0)),
        ("m/N\0\0\0", 1.0, (1, -1, 0)),
    ],
)
def test_unit_labels(label, to_si, exponents):
    unit = parse_unit(label)
    assert unit.to_si == pytest.approx(to_si, rel=1e-12)
    assert unit.exponents == exponents


@pytest.mark.parametrize(
    "label",
    ["", "NONE", "V", "m/", "m/s^", "(m", "m)", "^2", "m/0", "m=s", "NM", "/N", "()", "M/MN", "mv/N", "\ufffdm", "°C",
     "m/N rms", "dB", "m + N", "m/N x1000", "m" * 300, "(" * 150],
)  # fmt: skip
def test_labels_that_are_not_understood(label):
    assert parse_unit(label) is None


def test_units_of_frequencies_phases_and_levels():
    known = {"Hz": 1, "kHz": 1e3, "KHZ": 1e3, "MHz": 1e6, "mHz": 1e-3, "rpm": 1 / 60, "cpm": 1 / 60, "rev/min": 1 / 60,
             "rad/s": 0.5 / np.pi, "RAD/SEC": 0.5 / np.pi, "rad·s⁻¹": 0.5 / np.pi, "cycles/s": 1}  # fmt: skip
    assert {label: parse_frequency_unit(label) for label in known} == pytest.approx(known)
    assert [parse_frequency_unit(label) for label in ("", "1/s", "s", "MHZ", "m/s", "N", "rad")] == [None] * 7
    assert parse_phase_unit("°") == parse_phase_unit("Degrees") == pytest.approx(np.pi / 180)
    assert [parse_phase_unit(label) for label in ("rad", "grad", "", "Hz", "1")] == [1.0, None, None, None, None]
    levels = ["dB re 1 m/N", "dB (ref 1 m/N)", "DB[rel. 1 m/N]", "dB re: 1 m/N", "dB reference = 1 m/N"]
    assert [parse_level(label) for label in levels] == ["1 m/N"] * 5
    assert [parse_level(label) for label in ("dB", "dB m/N", "m/N", "dB re 1 V", "")] == [None] * 5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("g/V", "unit 'g/V' of frf is not understood; use motion per force, such as g/N"),
        ("g", "unit 'g' of frf is not understood"),
        ("frequency=1/s", "unit '1/s' of frequency is not understood; use Hz, kHz, rad/s or rpm"),
        ("phase=turned", "of phase is not understood; use deg or rad"),
        ("coordinates=N", "of coordinates is not understood; use m, mm or in"),
        ("speed=rpm", "unknown quantity 'speed' in unit; use one of frf, frequency, phase, coordinates"),
        ("g/N, mm/N", "unit states frf twice: g/N, mm/N; leave one out"),
    ],
)
def test_stated_units_that_are_wrong(text, message):
    with pytest.raises(ValueError, match=message):
        StatedUnits.parsed(text)


# ---------------------------------------------------------------- any file: stated, contradicted, without effect


@pytest.mark.parametrize("name", ["a.npz", "a.h5", "a.mat"])
def test_named_arrays_state_their_unit_or_the_user_does(tmp_path, name):
    given_set, path = frf_set(), tmp_path / name
    fields = {"f": FREQ_HZ, "H": given_set.h, "responses": names(given_set.responses),
              "excitations": names(given_set.excitations)}  # fmt: skip

    def write(**fields):
        if name == "a.mat":
            write_mat(path, **fields)
        elif name == "a.npz":
            np.savez(path, **fields)
        else:
            with pytest.importorskip("h5py").File(path, "w") as file:
                for key, value in fields.items():
                    file[key] = value

    write(**fields)
    with pytest.raises(FileContentError, match="the FRFs have no unit; give unit="):
        read_frfs(path, quantity="accelerance")
    np.testing.assert_allclose(read_frfs(path, unit="g/N").h, GRAVITY * given_set.h)
    np.testing.assert_allclose(read_frfs(path, unit="g/N, frequency=rad/s").freq_hz, FREQ_HZ / (2 * np.pi))
    write(**fields, unit="furlong")
    with pytest.raises(FileContentError, match="the unit 'furlong' is not understood; give unit="):
        read_frfs(path, quantity="accelerance")
    write(**fields, unit="m/s^2/N")
    with pytest.raises(FileContentError, match=r"unit of the FRFs is 'm/s\^2/N', not the one of unit=; leave unit out"):
        read_frfs(path, unit="g/N")
    np.testing.assert_allclose(read_frfs(path, unit="g/N", force_quantity=True).h, GRAVITY * given_set.h)
    for unit in ("phase=rad", "coordinates=mm", "dB re 1 m/s^2/N"):
        with pytest.raises(ValueError, match="has no effect on"):
            read_frfs(path, unit=unit)


@pytest.mark.parametrize("write", [write_npz, write_hdf5])
def test_the_own_layout_is_in_si_units(tmp_path, write):
    path = tmp_path / "a"
    write(path, frf_set())
    np.testing.assert_array_equal(read_frfs(path, unit="m/s^2/N").h, frf_set().h)
    with pytest.raises(FileContentError, match="not the one of unit="):
        read_frfs(path, unit="g/N")
    for options in ({"unit": "frequency=Hz"}, {"mapping": {"h": "h"}}, {"skip_lines": 1}):
        with pytest.raises(ValueError, match="has no effect on"):
            read_frfs(path, **options)


def test_an_option_must_have_an_effect_on_one_of_several_files(tmp_path):
    (tmp_path / "a.uff").write_bytes(function())
    write_mat(
        tmp_path / "b.mat", f=[10.0, 12.0, 14.0], A=2 * VALUES, responses="2:y", excitations="1:y", unit="m/s^2/N"
    )
    mapping = {"h": "A", "axes": "freq,out,in"}
    found = read_frfs(tmp_path / "a.uff", tmp_path / "b.mat", mapping=mapping)
    np.testing.assert_array_equal(found.h[:, :, 0].T, [VALUES, 2 * VALUES])
    with pytest.raises(ValueError, match=r"mapping h= and mapping axes= have no effect on .*a\.uff"):
        read_frfs(tmp_path / "a.uff", mapping=mapping)


def test_a_preamble_is_skipped_when_the_user_says_so(tmp_path):
    path = tmp_path / "a.txt"
    table = "f [Hz],1:x / 1:x real [m/N],1:x / 1:x imag [m/N]\n1,2,3\n"
    path.write_text(f"Analyser 7\nOperator: A, B\n\n{table}")
    with pytest.raises(FileContentError, match=r"a\.txt has its heading on line 4; give skip_lines=3"):
        read_frfs(path)
    assert read_frfs(path, skip_lines=3).h[0, 0, 0] == 2 + 3j
    path.write_text("Function: FRF H1\nX unit: Hz\n\n1\t5.0\t1e-3\t2e-3\n")
    with pytest.raises(FileContentError, match=r"has no heading that names frequencies and channels, .*skip_lines="):
        read_frfs(path)
    path.write_text(table)
    with pytest.raises(ValueError, match="skip_lines must be 0 or more, not -1"):
        read_frfs(path, skip_lines=-1)


def test_time_data_are_named(tmp_path):
    np.savez(tmp_path / "a.npz", t=FREQ_HZ, x=FREQ_HZ)
    with pytest.raises(FileContentError, match=r"has times \(t\) and no FRFs.*estimate FRFs .*pyFRF"):
        read_frfs(tmp_path / "a.npz")


# ---------------------------------------------------------------- files in which users met wrong values

RIGHT = "01-csv-units-in-round-brackets/right.csv"


@pytest.mark.parametrize(
    "name",
    ["01-csv-units-in-round-brackets/give-kHz.csv", "01-csv-units-in-round-brackets/give-phase-rad.csv",
     "03-testlab-mat-saved-in-MKS/give-g-per-N.mat", "05-uff-unit-not-understood/give-micrometre-latin1.uff",
     "05-uff-unit-not-understood/give-mils.uff"],
)  # fmt: skip
def test_reported_files_are_read_rightly(name):
    right = read_frfs(shared_data("reports", *RIGHT.split("/"))).receptance()
    found = read_frfs(shared_data("reports", *name.split("/"))).receptance()
    np.testing.assert_allclose(found.freq_hz, right.freq_hz, rtol=1e-6)
    np.testing.assert_allclose(found.matrix(right.responses, right.excitations), right.h, rtol=1e-4)


def test_a_reported_text_without_a_heading_is_refused():
    with pytest.raises(FileContentError, match=r"no heading that names frequencies and channels, .*give skip_lines="):
        read_frfs(shared_data("reports", "17-text-with-a-preamble", "give-analyser.txt"))


def test_a_reported_heading_in_radians_per_second():
    found = read_frfs(shared_data("reports", "u11-omega-heading", "48_rad_s.csv"))
    np.testing.assert_allclose(np.diff(found.freq_hz), 2.0, rtol=1e-3)


# ---------------------------------------------------------------- no label gives wrong values

#: Spellings of units with their size in SI, and labels that state no unit of their kind.
MOTION = {
    2: {"m/s^2": 1.0, "m/s²": 1.0, "m/s2": 1.0, "m/s**2": 1.0, "m s^-2": 1.0, "m·s⁻²": 1.0, "mm/s^2": 1e-3,
        "g": GRAVITY, "g's": GRAVITY, "mg": 1e-3 * GRAVITY, "in/s^2": INCH, "in/sec^2": INCH, "inch/s²": INCH,
        "ft/s^2": 12 * INCH, "mil/s^2": 1e-3 * INCH},
    1: {"m/s": 1.0, "mm/s": 1e-3, "in/s": INCH, "ips": INCH, "µm/s": 1e-6, "m·s⁻¹": 1.0},
    0: {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "\u03bcm": 1e-6, "um": 1e-6, "micron": 1e-6, "microns": 1e-6,
        "mil": 1e-3 * INCH, "mils": 1e-3 * INCH, "in": INCH, "inch": INCH, "in.": INCH, "ft": 12 * INCH, "cm": 1e-2,
        "nm": 1e-9},
}  # fmt: skip
FORCE = {"N": 1.0, "kN": 1e3, "mN": 1e-3, "MN": 1e6, "lbf": POUND, "lb": POUND, "lbs": POUND, "lb (force)": POUND,
         "kip": 1e3 * POUND, "kips": 1e3 * POUND, "kgf": GRAVITY, "newton": 1.0, "dyn": 1e-5}  # fmt: skip
FREQUENCY = {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "rad/s": 0.5 / np.pi, "rad/sec": 0.5 / np.pi, "rpm": 1 / 60}
PHASE = {"deg": np.pi / 180, "°": np.pi / 180, "degrees": np.pi / 180, "rad": 1.0, "radians": 1.0, "mrad": 1e-3}
WRONG = ["V", "mV", "EU", "furlong", "?", "rms", "x1e-3", "\ufffdm", "dB", "log", "1e3", "*10", "NONE"]
BRACKETS = ["[{}]", "({})", "{{{}}}", "<{}>", " [{}]", " ( {} )", ", {}", " / ({})", " in {}", "_{}", ": {}", " {}"]
CASES = [str, str, str.upper, str.lower, str.title]
#: Symbols that mean something else, or nothing, in other letters.
FIXED = {"mN", "MN", "nm", "MHz"}
PADDING = ["{}", " {}", "{}  ", "{}\0\0", "  {} \0"]
ENCODINGS = ["utf-8", "latin-1", "utf-8-sig", "utf-16", "cp1252"]
POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}
LINES = np.array([10.0, 12.0, 15.0])
H = np.array([1.5 - 2.0j, -3.0 + 0.5j, 0.25 + 0.125j])
MUTATIONS = settings(
    max_examples=400, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)


@dataclass
class Label:
    """Motion per force in letters, one of it in SI (None: it may mean anything), and its power of i w."""

    motion: str
    force: str
    text: str
    size: float | None
    power: int


@st.composite
def labels(draw):
    power = draw(st.sampled_from((0, 1, 2)))
    motion, force = draw(st.sampled_from(sorted(MOTION[power]))), draw(st.sampled_from(sorted(FORCE)))
    size = MOTION[power][motion] / FORCE[force]
    form = draw(st.sampled_from(["{0}/{1}", "({0})/({1})", "({0})/{1}", "{0} / {1}", "{0} per {1}", "(1/{1})*({0})"]))
    if not {motion.partition("/")[0], force} & FIXED:
        motion, force = draw(st.sampled_from(CASES))(motion), draw(st.sampled_from(CASES))(force)
    if draw(st.integers(0, 9)):
        return Label(motion, force, form.format(motion, force), size, power)
    wrong = draw(st.sampled_from(WRONG))
    if draw(st.booleans()):
        return Label(wrong, force, form.format(wrong, force), None, power)
    return Label(motion, wrong, f"{form.format(motion, force)} {wrong}", None, power)


def encoded(text, encoding):
    try:
        return text.encode(encoding)
    except UnicodeEncodeError:
        return text.encode("utf-8")


def is_read(path, size, power, hertz):
    """Whether a file is read and not refused; its values are then right."""
    try:
        found = read_frfs(path)
    except FileContentError:
        return False
    assert size is not None, "a label was read that is no unit"
    assert hertz is not None, "a label was read that is no unit of frequency"
    assert POWER[found.quantity] == power
    np.testing.assert_allclose(found.freq_hz, hertz * LINES, rtol=1e-9)
    np.testing.assert_allclose(found.h[:, 0, 0], size * H, rtol=1e-9)
    return True


def frequency_label(draw, wrong):
    label = draw(st.sampled_from([*FREQUENCY, *FREQUENCY, *wrong]))
    return label if label in FIXED else draw(st.sampled_from(CASES))(label), FREQUENCY.get(label)


def test_no_heading_of_a_text_table_gives_wrong_values(tmp_path):
    path, read = tmp_path / "mutated.csv", Counter()

    @MUTATIONS
    @given(st.data(), labels())
    def mutate(data, label):
        draw, size = data.draw, label.size

        def one_of(*texts):
            return draw(st.sampled_from(texts))

        hz_label, hertz = frequency_label(draw, ["furlong", "", "1/s", "s"])
        pair = one_of("102:+y / 101:+y", "bar:102:+y/bar:101:+y", "102Y+ / 101Y+", "H1(102:+y / 101:+y)")
        bracket = one_of(*BRACKETS)
        if one_of(True, False):
            parts = {one_of("real", "Re", "real part"): H.real, one_of("imag", "Im", "imaginary part"): H.imag}
            names = [f"{pair} {part}{bracket.format(label.text)}" for part in parts]
            columns = [*parts.values()]
        else:
            angle = one_of(*PHASE, *PHASE, "", "turns?", "grad")
            level = one_of("{}", "{}", "dB re 1 {}", "dB (ref 1 {})", "dB rel. 1 {}", "dB {}", "dB", "{} dB")
            is_level = level != "{}"
            size = None if angle not in PHASE or (is_level and "1" not in level) else size
            sizes = 20 * np.log10(abs(H)) if is_level else abs(H)
            columns = [sizes, np.angle(H) / PHASE.get(angle, 1.0)]
            names = [f"{pair} {one_of('mag', 'magnitude', 'Amplitude')}{bracket.format(level.format(label.text))}",
                     f"{pair} phase{one_of(*BRACKETS).format(one_of(*CASES)(angle))}"]  # fmt: skip
        word = one_of("f", "Frequency", "freq", "Frequenz", "omega", "FREQUENCY", "Fréquence", "Excitation frequency")
        heading = [one_of("{}", " {} ").format(each) for each in (word + one_of(*BRACKETS).format(hz_label), *names)]
        mark = one_of(",", ";", "\t")
        rows = [mark.join(f'"{each}"' if mark in each else each for each in heading)]
        rows += [mark.join(map(repr, map(float, row))) for row in zip(LINES, *columns, strict=True)]
        path.write_bytes(encoded("\n".join([*rows, ""]), one_of(*ENCODINGS)))
        read[is_read(path, size, label.power, hertz)] += 1

    mutate()
    assert read.total() >= 200
    assert read[True] >= 50


def test_no_label_of_a_universal_file_gives_wrong_values(tmp_path):
    path, read = tmp_path / "mutated.uff", Counter()

    @MUTATIONS
    @given(st.data(), labels())
    def mutate(data, label):
        def one_of(*texts):
            return data.draw(st.sampled_from(texts))

        hz_label, hertz = frequency_label(data.draw, ["furlong", "1/s", "s"])
        units = [label.text, one_of("NONE", "")] if one_of(True, False) else [label.motion, label.force]
        size = label.size if units[0] != "NONE" and (units[1] != "NONE" or units[0] == label.text) else None
        bracket, padding = one_of("{}", "{}", "({})", "[{}]"), one_of(*PADDING)
        units = [each if each in ("NONE", "") else padding.format(bracket.format(each)) for each in units]
        assume(all(len(each.encode()) <= 20 for each in units))  # labels that are cut are others
        axis = one_of("Force", "Übertragung", "Größe der Kraft ÄÖÜ", "NONE")
        encoding, by_bytes = one_of("utf-8", "latin-1"), one_of(True, False)
        axes = {"numerator": (one_of((8, 11, 12)[label.power], 1), "UNIT0"), "denominator": (13, "UNIT1")}
        content = function(H, LINES, even=False, abscissa=(18, "UNIT2"), **axes)
        for number, unit in enumerate((*units, hz_label)):
            old = f"{'NONE':20} {f'UNIT{number}':20}".encode()
            assert old in content
            content = content.replace(old, b" ".join(field(each, encoding, by_bytes) for each in (axis, unit)))
        path.write_bytes(content)
        read[is_read(path, size, label.power, hertz)] += 1

    mutate()
    assert read.total() >= 200
    assert read[True] >= 50


def field(text, encoding, by_bytes):
    """Return 20 columns of a record, filled and cut by bytes or by characters."""
    return encoded(text, encoding)[:20].ljust(20) if by_bytes else encoded(f"{text[:20]:20}", encoding)
