"""The clamp of a measured plate from two tests, and the prediction of a third.

python cases/measured-plate/run.py FOLDER [--out DIR]     FOLDER holds the three MAT files
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.io
from scipy import linalg

import jointfrf as jf
from jointfrf.channels.check.residues import Resonances, resonances
from jointfrf.frf.bands import in_bands as inside
from jointfrf.identification.result import columns_of
from jointfrf.io import Channel, FrfSet

HERE = Path(__file__).resolve().parent
SOURCE = "https://github.com/grcarmenaty/pymodal, commit aaa853f, folder tests/data/mat_FRFs (MIT)"
FILES = {
    "00A_Ref_1.MAT": "7cb9a8d240b02774041d588688a9f53618a47091440b57724527b036a74f2533",
    "00A_Ref_2.MAT": "4ad802fc5fa3a449ac80ff7bd5407eda7d2cd4a4b596c1d894ed0e9d5f2cdb95",
    "27A_C60.MAT": "a2d0a6b81df8e1d2a3c4aae69a7a168bf551da1b294e77755b38a91d94384e55",
}
#: Lines of the files, Hz; responses that differ from their neighbours, 30 is where the force acts.
STEP, LEFT_OUT, FORCE = 0.5, (10, 30, 70), 30
#: Bands about the modes that are fitted, Hz; every second line, of both bands together every fourth.
LOW = [(45.0, 62.0), (112.0, 134.0), (300.0, 340.0), (370.0, 400.0)]
HIGH = [(435.0, 475.0), (750.0, 815.0), (860.0, 910.0)]
#: What the model misses of an FRF at a peak, where damping differs from mode to mode, and of an accelerance anywhere:
#: a background that all responses have, (m/s^2)/N. `background` measures it.
RELATIVE, FLOOR = 0.3, 5.0
#: Standard deviation of a natural frequency by the model error of assembly.toml: 1 % of stiffness and of mass.
OF_FREQUENCY = np.sqrt(2) * 0.01 / 2
DRAWS = 400
#: Young's modulus and density of assembly.toml; what modes depend on, and what FRFs depend on beside it.
E, RHO = 72.587e9, 2715.98
OF_MODES, OF_FRFS = ("clamp.k_z", "plate/youngs_modulus", "plate/density"), ("clamp.h_z", "plate/loss_factor")


def files_of(folder: Path) -> dict[str, Path]:
    """Return the three files, or leave with what is missing or differs, and where to get it."""
    found = {name: folder / name for name in FILES}
    missing = [name for name, path in found.items() if not path.is_file()]
    if missing:
        sys.exit(f"{folder} lacks {', '.join(missing)}; get them from {SOURCE}")
    for name, path in found.items():
        own = hashlib.sha256(path.read_bytes()).hexdigest()
        if own != FILES[name]:
            sys.exit(f"{path} has the SHA-256 {own}, not {FILES[name]}; get it again from {SOURCE}")
    return found


def read(path: Path, responses: Sequence[int] | None = None, force: str = f"{FORCE}:-z") -> FrfSet:
    """Return the FRFs of a file: 6401 lines of 81 accelerances, no frequencies, no unit."""
    h = next(value for name, value in scipy.io.loadmat(path).items() if not name.startswith("__"))
    kept = [k for k in range(1, h.shape[1] + 1) if k not in LEFT_OUT] if responses is None else list(responses)
    names = tuple(Channel.parse(f"{k}:+z") for k in kept)
    lines = h[1:, [k - 1 for k in kept], None].astype(complex)
    return FrfSet(STEP * np.arange(1, len(h)), names, (Channel.parse(force),), lines, "accelerance", source=path.name)


def in_bands(frfs: FrfSet, bands: Sequence[tuple[float, float]], step: int = 2) -> FrfSet:
    """Return every second line of the bands, or another share of them."""
    kept = np.flatnonzero(inside(frfs.freq_hz, bands))[::step]
    return replace(frfs, freq_hz=frfs.freq_hz[kept], h=frfs.h[kept])


def background(frfs: FrfSet) -> float:
    """Return the median accelerance between the second and the third mode, where the plate itself has little."""
    return float(np.median(abs(in_bands(frfs, [(160.5, 259.5)], 1).h)))


def checked(path: Path) -> list[str]:
    """Return what `check_frfs` says where the force is believed at 29, at 30, and at 30 against the sensors."""
    said = []
    for force in ("29:+z", "30:+z", "30:-z"):
        frfs = in_bands(read(path, range(1, 82), force), [(20.0, 1400.0)], 1).receptance()
        channels = {"responses": frfs.responses, "forces": frfs.excitations}
        found = jf.check_frfs(frfs.freq_hz, frfs.h, **channels, read_as="accelerance").findings
        said += [f"force at {force}: {one.severity}: {one.text} [{one.code}]" for one in found]
    return said


def modes_of(frfs: FrfSet, high: float = 1400.0) -> Resonances:
    """Return the resonances up to a frequency, Hz."""
    lines = in_bands(frfs, [(20.5, high)], 1).receptance()
    return resonances(lines.freq_hz, lines.h[:, :, 0])


def fitted(frfs: FrfSet, model: str = "assembly.toml") -> jf.Fit:
    """Fit the clamp with a stated error of the FRFs: the relative one, and the background of the accelerance."""
    own = jf.measured_assembly(HERE / model, frfs)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # findings are printed
        return jf.identify_model(
            own.freq_hz, own.h, own.assembly, own.responses, own.forces, force_gains=own.force_gains, fixed=own.fixed,
            noise=jf.StatedNoise(RELATIVE, accelerance=FLOOR), accept=["driving-point-sign", "quantity"],
        )  # fmt: skip


class Plate:
    """Modes of assembly.toml for values of its unknowns, in a basis of the modes of several clamps."""

    def __init__(self, frfs: FrfSet) -> None:
        part = jf.measured_assembly(HERE / "assembly.toml", frfs).parts["plate"]
        model = part.structure.model
        strip = np.vstack([model.shown[port].toarray() for port in model.region_ports("strip:z")])
        k, m = model.stiffness.toarray(), model.mass.toarray()
        shapes = [linalg.eigh(k + s * strip.T @ strip, m, subset_by_index=[0, 24])[1] for s in (1e9, 1e10, 1e11, 1e13)]
        left, size, _ = linalg.svd(np.hstack([one / linalg.norm(one, axis=0) for one in shapes]), full_matrices=False)
        basis = left[:, size > 1e-8]
        self.k, self.m, self.strip = basis.T @ k @ basis, basis.T @ m @ basis, strip @ basis
        nodes = {tuple(np.round(at, 6)): node for node, at in part.places.items()}
        points = [nodes[(*np.round(position(k), 6), 0.0)] for k in range(1, 82)]
        self.points = basis[[model.index(f"{node}:z") for node in points]]

    def modes(self, clamp: float, e: float = E, rho: float = RHO) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return frequencies, Hz, shapes at the 81 points, and the part of the stiffness that is in the clamp."""
        own = clamp * self.strip.T @ self.strip
        squared, v = linalg.eigh(e / E * self.k + own, rho / RHO * self.m, subset_by_index=[0, 15])
        return np.sqrt(abs(squared)) / (2 * np.pi), self.points @ v, np.einsum("ir,ij,jr->r", v, own, v) / squared


def position(point: int) -> tuple[float, float]:
    """Return x, y of a measured point, m."""
    i, j = divmod(point - 1, 9)
    return 0.27 - 0.03 * j, 0.27 - 0.03 * i


def matched(found: Resonances, frfs: FrfSet, shapes: np.ndarray) -> list[tuple[int, float]]:
    """Return for each measured mode the mode of the model with the highest MAC, and this."""
    rows = [one.node - 1 for one in frfs.responses]
    own = shapes[rows] / linalg.norm(shapes[rows], axis=0)
    mac = (found.real / linalg.norm(found.real, axis=1)[:, None] @ own) ** 2
    return [(int(row.argmax()), float(row.max())) for row in mac]


def drawn(fit: jf.Fit, names: Sequence[str], count: int = DRAWS) -> np.ndarray:
    """Return draws of positive parameters, normal in their logarithms by 95 % intervals and correlations of a fit."""
    limits, order = fit.confidence_interval(0.95), list(fit.value)
    at = [order.index(name) for name in names]
    low, high = np.array([np.clip(limits[name], fit.value[name] / 100, fit.value[name] * 100) for name in names]).T
    spread = np.log(high / low) / (2 * 1.96)
    generator = np.random.default_rng(1)
    normal = generator.multivariate_normal(np.zeros(len(at)), fit.correlation[np.ix_(at, at)], count)
    return np.exp((np.log(low) + np.log(high)) / 2 + spread * normal)


def predicted(plate: Plate, fit: jf.Fit) -> np.ndarray:
    """Return draws of the natural frequencies with a model error of each, shape (draws, modes), Hz."""
    found = np.array([plate.modes(*values)[0] for values in drawn(fit, OF_MODES)])
    return found * (1 + OF_FREQUENCY * np.random.default_rng(2).standard_normal(found.shape))


def predicted_frfs(plate: Plate, fit: jf.Fit, freq_hz: np.ndarray, points: Sequence[int]) -> np.ndarray:
    """Return draws of accelerances, shape (draws, n_freq, points), (m/s^2)/N."""
    omega, found = 2 * np.pi * freq_hz[:, None], []
    generator, rows = np.random.default_rng(2), [k - 1 for k in points]
    for k, e, rho, h, eta in drawn(fit, OF_MODES + OF_FRFS, 100):
        freq, shapes, share = plate.modes(k, e, rho)
        squared = (2 * np.pi * freq * (1 + OF_FREQUENCY * generator.standard_normal(freq.size))) ** 2
        loss = eta * (1 - share) + h / k * share
        y = (shapes[FORCE - 1] / (squared * (1 + 1j * loss) - omega**2)) @ shapes[rows].T
        found.append(-(omega**2) * y)
    return np.array(found)


def shown(fit: jf.Fit) -> list[str]:
    """Return a table of a fit: value, 95 % interval, unit."""
    limits = fit.confidence_interval(0.95)
    unit = {one.name: one.unit for one in fit.parameters}
    rows = [("parameter", "value", "95 % interval", "unit")]
    rows += [(k, f"{v:.3g}", "{:.2g} .. {:.2g}".format(*limits[k]), unit[k]) for k, v in fit.value.items()]
    about = f"converged: {fit.is_converged}, residual {fit.test.ratio:.2f} times the stated error"
    return [*columns_of(rows), about]


def frequency_table(plate: Plate, fit: jf.Fit, tests: Mapping[str, FrfSet]) -> list[str]:
    """Return measured and predicted frequencies mode by mode."""
    draws = predicted(plate, fit)
    low, high = np.quantile(draws, (0.025, 0.975), axis=0)
    middle, shapes, _ = plate.modes(*(fit.value[name] for name in OF_MODES))
    rigid, found = plate.modes(1e14)[0], {}
    for name, frfs in tests.items():
        modes = modes_of(frfs, 1500.0)
        for freq, (mode, mac) in zip(modes.freq_hz, matched(modes, frfs, shapes), strict=True):
            if mac > found.get((name, mode), (0, 0.5))[1]:
                found[name, mode] = freq, mac
    rows = [("mode", "rigid clamp", "fitted", "95 % interval", *tests, "MAC of the first")]
    for i in range(11):
        own = [f"{found[name, i][0]:.1f}" if (name, i) in found else "" for name in tests]
        mac = next((f"{found[name, i][1]:.2f}" for name in tests if (name, i) in found), "")
        rows.append((str(i + 1), f"{rigid[i]:.1f}", f"{middle[i]:.1f}", f"{low[i]:.1f} .. {high[i]:.1f}", *own, mac))
    return columns_of(rows)


def figure(plate: Plate, fit: jf.Fit, frfs: FrfSet, target: Path, points: Sequence[int] = (5, 25, 60)) -> None:
    """Draw the FRFs of the cut plate over the band predicted for the uncut one."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    freq = np.arange(40.0, 950.0, 0.5)
    low, high = np.quantile(abs(predicted_frfs(plate, fit, freq, points)), (0.025, 0.975), axis=0)
    drawing, axes = plt.subplots(len(points), 1, figsize=(8, 7), sharex=True, layout="constrained")
    shown = in_bands(frfs, [(freq[0], freq[-1])], 1)
    for i, (point, ax) in enumerate(zip(points, axes, strict=True)):
        row = [one.node for one in shown.responses].index(point)
        ax.fill_between(freq, low[:, i], high[:, i], color="#9ecae1", label="predicted without cut, 95 %")
        ax.axhline(FLOOR, color="#888888", lw=0.8, ls="--", label="stated error of the measurement")
        ax.semilogy(shown.freq_hz, abs(shown.h[:, row, 0]), "k", lw=0.8, label="measured with cut, C60")
        ax.set(xlim=(freq[0], freq[-1]), ylim=(0.3, 1500), ylabel="accelerance, m/(s² N)")
        ax.set_title(f"response at point {point}, force at point {FORCE}", loc="left", fontsize=9)
    drawing.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=9)
    axes[-1].set_xlabel("frequency, Hz")
    drawing.savefig(target, dpi=110)


def main(arguments: Sequence[str] | None = None) -> None:
    """Check the files, fit, predict, print; with --out draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help=f"holds {', '.join(FILES)}; from {SOURCE}")
    parser.add_argument("--out", type=Path, help="folder for the figure")
    parser.add_argument("--no-fit", action="store_true", help="only the data check and the modes")
    args = parser.parse_args(arguments)
    paths = files_of(args.folder)
    first, second, cut = (read(path) for path in paths.values())
    print("Data check, 20 to 1400 Hz", *checked(paths["00A_Ref_1.MAT"]), sep="\n")
    print(f"\nBackground between modes 2 and 3: {background(first):.1f} and {background(second):.1f} (m/s^2)/N")
    tests = {"Ref_1": first, "Ref_2": second, "C60": cut}
    rows = [("test", *(f"mode {i}" for i in range(1, 9)))]
    rows += [(name, *(f"{f:.2f}" for f in modes_of(one).freq_hz[:8])) for name, one in tests.items()]
    rows += [(f"eta {name}", *(f"{f:.4f}" for f in modes_of(one).loss_factor[:8])) for name, one in tests.items()]
    print("\nResonances of each test, Hz, and loss factors", *columns_of(rows), sep="\n")
    if args.no_fit:
        return
    both = replace(first, h=(first.h + second.h) / 2)
    wanted = {
        "Ref_1, modes 1 to 4": (first, LOW, "assembly.toml"),
        "Ref_2, modes 1 to 4": (second, LOW, "assembly.toml"),
        "Ref_1, modes 5 to 7": (first, HIGH, "assembly.toml"),
        "Ref_2, modes 5 to 7": (second, HIGH, "assembly.toml"),
        "both, modes 1 to 7": (both, LOW + HIGH, "assembly.toml"),
        "both, modes 1 to 4, line joint": (both, LOW, "edge.toml"),
    }
    fits = {}
    for name, (frfs, bands, model) in wanted.items():
        fits[name] = fitted(in_bands(frfs, bands, 2 if len(bands) < len(LOW + HIGH) else 4), model)
        print(f"\n{name}", *shown(fits[name]), sep="\n", flush=True)
    plate, found = Plate(in_bands(both, LOW)), fits["both, modes 1 to 7"]
    held_out = fits["Ref_1, modes 1 to 4"]
    print("\nPredicted from Ref_1, modes 1 to 4, Hz", *frequency_table(plate, held_out, tests), sep="\n")
    print("\nPredicted from both, modes 1 to 7, Hz", *frequency_table(plate, found, tests), sep="\n")
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        figure(plate, found, cut, args.out / "prediction.png")


if __name__ == "__main__":
    main()
