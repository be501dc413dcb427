"""Datasets of Universal Files, written record by record."""

import numpy as np

FREQ_HZ = np.array([10.0, 12.0, 14.0])
VALUES = np.array([1.0 + 2.0j, 3.0 - 4.0j, -5.0 + 6.0j])


def dataset(kind, *records):
    """Lines of a dataset with its delimiters."""
    return "\n".join(["    -1", f"{kind:6d}", *records, "    -1", ""])


def function(
    values=VALUES,
    freq_hz=FREQ_HZ,
    *,
    function_type=4,
    response=(1, 2),
    reference=(1, 2),
    numerator=(12, "m/s^2"),
    denominator=(13, "N"),
    abscissa=(18, "Hz"),
    entities=("NONE", "NONE"),
    number_type=6,
    even=True,
    n_values=None,
    binary=False,
):
    """Dataset 58 or, as bytes, 58b."""
    axes = [f"{kind:10d}    0    0    0 {'NONE':20} {unit:20}" for kind, unit in (abscissa, numerator, denominator)]
    step = freq_hz[1] - freq_hz[0] if len(freq_hz) > 1 else 1.0
    start = f"{freq_hz[0]:13.5e}{step:13.5e}" if even else f"{0:13.5e}{0:13.5e}"
    records = [
        *["NONE"] * 5,
        f"{function_type:5d}{1:10d}{0:5d}{0:10d} {entities[0]:10}{response[0]:10d}{response[1]:4d}"
        f" {entities[1]:10}{reference[0]:10d}{reference[1]:4d}",
        f"{number_type:10d}{n_values or len(values):10d}{int(even):10d}{start}{0:13.5e}",
        *axes,
        f"{0:10d}    0    0    0 {'NONE':20} {'NONE':20}",
    ]
    if binary:
        head = "\n".join(["    -1", f"    58b{1:6d}{2:6d}{11:12d}{16 * len(values):12d}", *records, ""]).encode()
        return head + np.asarray(values, dtype="<c16").tobytes() + b"\n    -1\n"
    return dataset(58, *records, *numbers(values, freq_hz, number_type, even)).encode()


def numbers(values, freq_hz, number_type, even):
    """Records 12 of dataset 58."""
    values = np.ascontiguousarray(values)
    if not even:
        return [f"{f:13.5e}{v.real:20.11e}{v.imag:20.11e}" for f, v in zip(freq_hz, values, strict=True)]
    flat = values.view(float) if np.iscomplexobj(values) else values
    width, a_line = ("20.11e", 4) if number_type in (4, 6) else ("13.5e", 6)
    return ["".join(f"{v:{width}}" for v in flat[i : i + a_line]) for i in range(0, len(flat), a_line)]


def units(length, force):
    return dataset(164, f"{9:10d}{'own':20}{2:10d}", f"{length:25.16e}{force:25.16e}{1:25.16e}", f"{273.15:25.16e}")


def nodes_2411(coordinates, displacement=0):
    rows = []
    for node, xyz in coordinates.items():
        rows += [f"{node:10d}{0:10d}{displacement:10d}{1:10d}", "".join(f"{x:25.16e}" for x in xyz)]
    return dataset(2411, *rows)


def nodes_15(coordinates, definition=0):
    rows = [f"{n:10d}{definition:10d}{0:10d}{1:10d}" + "".join(f"{x:13.5e}" for x in p) for n, p in coordinates.items()]
    return dataset(15, *rows)


def system_2420(label, matrix):
    rows = ["".join(f"{x:25.16e}" for x in row) for row in matrix]
    return dataset(2420, f"{1:10d}", "part", f"{label:10d}{0:10d}{8:10d}", "axes", *rows)
