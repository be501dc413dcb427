"""Modules with a format of files and with a law, as a contributor or another package adds them."""

FORMAT = """
import numpy as np
from jointfrf.files import write_file
from jointfrf.io.file_format import FileFormat, FrfArrays

def read(path, limit, reading):
    freq_hz, h = np.loadtxt(path, skiprows=1, unpack=True)
    return FrfArrays(freq_hz, h[:, None, None], "freq,out,in", ["1:x"], ["1:x"], "receptance", "mm/N")

def write(path, frfs):
    rows = zip(frfs.freq_hz, 1e3 * frfs.h[:, 0, 0].real)
    write_file(path, "".join(["two columns\\n", *(f"{f} {h}\\n" for f, h in rows)]))

PAIRS = FileFormat(name="Pairs", suffixes=(".pairs",), content="real FRFs of one point", read=read, write=write,
                   has_mark=lambda head: head.startswith(b"two columns"), needs="`jointfrf[pairs]`")
"""

LAW = '''"""A spring beside a mass-like term."""

from dataclasses import dataclass

import numpy as np

from jointfrf.laws.law import JointLaw, LawField


@dataclass(frozen=True)
class InertialSpring(JointLaw):
    """K*(w) = k + i h - w^2 m."""

    k: float
    inertance: float

    word = "inertial-spring"
    parameters = (
        LawField("k", "stiffness", 0.0),
        LawField("inertance", "number", 0.0, 10.0, meaning="Force per relative acceleration."),
    )

    def stiffness(self, omega):
        return self.k - omega**2 * self.inertance + 0j

    def slopes(self, omega):
        return np.array([np.ones_like(omega), -(omega**2)]) + 0j
'''
