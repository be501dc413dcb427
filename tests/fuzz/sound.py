"""Sound arguments of every public function, by its parameters: what random arguments are made from."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

import jointfrf as jf

__all__ = ["sound_arguments"]


def sound_arguments(folder: Path) -> dict[str, dict[str, Any]]:
    """Return arguments by the names of functions and parameters; files for those that read are put into the folder."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        arrays = _arrays()
        return {**arrays, **_structures(), **_identification(arrays), **_solids(), **_files(folder)}


def _chains() -> dict[str, Any]:
    freq = np.linspace(0.5, 10, 24)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    h_a, h_b = a.receptance(freq), b.receptance(freq)
    joint, first = jf.Joint([2000.0], [3.0], ["x"]), jf.Joint([1000.0], [1.5], ["x"])
    whole = jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), [1], [0])
    begun = jf.couple(h_a, h_b, first.dynamic_stiffness(freq), [1], [0])
    inner = np.ix_(range(24), [1, 2], [1, 2])
    return dict(freq=freq, a=a, b=b, h_a=h_a, h_b=h_b, joint=joint, first=first, whole=whole, gamma=whole[inner],
                alpha=begun[inner])  # fmt: skip


def _arrays() -> dict[str, dict[str, Any]]:
    """Functions of the algebra."""
    c = _chains()
    rng = np.random.default_rng(3)
    lines = rng.standard_normal((6, 4, 4)) + 1j * rng.standard_normal((6, 4, 4)) + 3 * np.eye(4)
    freq, pairs = np.linspace(1.0, 6.0, 6), {"freq_hz": c["freq"], "h_exact": c["gamma"][:, 0, 0], "band": (1.0, 9.0)}
    x = np.linspace(-1.0, 1.0, 4)
    k0 = c["first"].dynamic_stiffness(c["freq"])
    out = {"freq_hz": freq}
    return {
        "invert": {"a": lines, **out},
        "solve": {"a": lines, "b": lines[:, :, :2], **out},
        "reciprocal_condition": {"a": lines},
        "couple": {
            "h_a": c["h_a"], "h_b": c["h_b"], "k_joint": c["joint"].dynamic_stiffness(c["freq"]), "dofs_a": [1],
            "dofs_b": [0], "freq_hz": c["freq"],
        },
        "couple (laws)": {
            "h_a": c["h_a"], "h_b": c["h_b"], "k_joint": jf.LawJoint({"x": jf.PowerLaw(2e3, 1e2, 0.5)}), "dofs_a": [1],
            "dofs_b": [0], "freq_hz": c["freq"],
        },
        "validate": {
            "freq_hz": c["freq"], "measured": c["gamma"], "h_a": c["h_a"], "h_b": c["h_b"], "joint": c["joint"],
            "dofs_a": [1], "dofs_b": [0], "outputs": [1, 2], "inputs": [1, 2], "band": (1.0, 9.0),
            "responses": ["a", "b"], "forces": ["a", "b"],
        },
        "modify": {"alpha": lines, "d": lines[:, :2, :2], "dofs": [1, 2], **out},
        "find_modification": {"alpha": lines, "gamma": lines + np.eye(4), **out},
        "ismm": {"alpha": c["alpha"], "gamma": c["gamma"], "k_initial": k0, "freq_hz": c["freq"]},
        "inverse_substructuring": {"gamma": c["gamma"], "freq_hz": c["freq"]},
        "joint_compliance": {"gamma": c["gamma"], "freq_hz": c["freq"]},
        "compliance_factors": {"gamma": lines, "transform": np.eye(4), **out},
        "compliance_covariance": {"gamma": lines, "variance": abs(lines) ** 2, "transform": np.eye(4), **out},
        "decouple": {
            "equation": "rs", "h_a": lines, "h_b": lines, "h_c": lines[:, :1, :1], "dofs_j": [0], "dofs_k": [1],
            "dofs_r": [2], "dofs_s": [3], **out,
        },
        "central_difference": {"h": lines, "spacing": x, "sign": -1.0, **out},
        "difference_weights": {"spacing": x},
        "difference_error": {"spacing": 0.01, "bending_stiffness": 2000.0, "joint_stiffness": 5e3},
        "transform": {"h": lines, "t_out": np.ones((3, 4)), "t_in": np.ones((2, 4)), **out},
        "pollute": {"h": lines, "level": 0.05, "seed": 1},
        "realisations": {"h": lines, "level": 0.05, "seed": 1, "count": 2},
        "sweep": {"operation": jf.invert, "arrays": {"a": lines}, "out": np.empty((6, 4, 4), complex), "jobs": 1},
        "plan_sweep": {"operation": jf.invert, "arrays": {"a": lines}, "out": np.empty((6, 4, 4), complex), "jobs": 1},
        "semm": {"h_model": lines, "h_measured": lines[:, :2, :2], "outputs": [0, 1], "inputs": [0, 1], **out},
        "semm_standard_error": {
            "h_model": lines, "h_measured": lines[:, :2, :2], "outputs": [0, 1], "inputs": [0, 1], "noise": 0.01,
        },
        "band_mean": {"freq_hz": c["freq"], "k_joint": k0, "bands": (1.0, 9.0), "dofs": ["x"]},
        "in_bands": {"freq_hz": c["freq"], "bands": [(1.0, 4.0), (5.0, 9.0)]},
        "as_bands": {"bands": {"x": (1.0, 9.0)}, "dofs": ["x"], "freq_hz": c["freq"]},
        "amplitude_error": {**pairs, "h": 1.01 * c["gamma"][:, 0, 0]},
        "frequency_error": {**pairs, "h": 1.01 * c["gamma"][:, 0, 0]},
        "has_peak": {"h": c["gamma"][:, 0, 0], "freq_hz": c["freq"], "band": (1.0, 9.0)},
        "peak": {"h": c["gamma"][:, 0, 0], "freq_hz": c["freq"], "band": (1.0, 9.0)},
        "sensitivity": {
            "freq_hz": c["freq"], "h_c": c["whole"], "joint": c["joint"], "dofs_j": [1], "dofs_k": [2], "output": 0,
            "input": 3,
        },
        "propose_bands": {"freq_hz": c["freq"], "change": abs(c["gamma"][:, 0, 0]) + 1e-9},
        "monte_carlo": {
            "gamma": c["gamma"], "level": 0.05, "count": 3, "alpha": c["alpha"], "k_initial": k0, "freq_hz": c["freq"],
            "method": "ismm",
        },
        "driving_point_check": {"h": c["gamma"]},
        "set_engine": {"engine": "auto"},
        "use_engine": {"engine": "plain"},
        "frfs_of_arrays": {
            "freq_hz": freq, "h": lines[:, :2, :2], "responses": ["1:x", "2:y"], "excitations": ["1:x", "2:y"],
            "unit": "m/N", "coherence": np.full((6, 2, 2), 0.9), "averages": 8,
        },
    }  # fmt: skip


def _structures() -> dict[str, dict[str, Any]]:
    """Models, joints and laws."""
    c = _chains()
    k, m = np.diag([3.0, 4.0, 5.0]), np.eye(3)
    substructures = [jf.Substructure(model, (dof,)) for model, dof in ((c["a"], "2:x"), (c["b"], "1:x"))]
    law = jf.LawJoint({"x": jf.SpringLaw(2000.0, 3.0)})
    corners = {"1": [0.0, 0.0, 0.0], "2": [0.2, 0.0, 0.0], "3": [0.0, 0.2, 0.0], "4": [0.2, 0.2, 0.0]}
    square = jf.PointModel(
        np.zeros((4, 4)), np.eye(4), [f"{node}:z" for node in corners],
        places={node: np.array(place) for node, place in corners.items()},
    )  # fmt: skip
    return {
        "chain": {"masses": [5, 3], "stiffness": [2500, 3500], "damping": [3, 4]},
        "plate": {
            "length": 0.2, "width": 0.1, "thickness": 0.002, "youngs_modulus": 210e9, "density": 7850.0,
            "elements": (2, [0.0, 0.04, 0.1]), "edges": ("clamped", "free", "free", "supported"),
            "points": {"tip": [0.15, 0.05]}, "regions": {"weld": jf.PlateRegion((0.0, 0.0), (0.2, 0.0), 2)},
        },
        "NodeRegion": {"name": "base", "nodes": ["1", "2", "3", "4"], "degree": 1, "size": 0.04},
        "add_regions": {"model": square, "regions": [jf.NodeRegion("base", list(square.places), degree=1)]},
        "with_modal_damping": {"model": c["a"], "ratios": [0.01, 0.02]},
        "rigid_body": {"mass": 2.0, "inertia": [0.1, 0.1, 0.2], "points": {"edge": [0.5, 0.0, 0.0]}},
        "beam": dict(length=0.3, n_elements=3, youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006),
        "Model": {"stiffness": k, "mass": m, "dofs": ("1:x", "2:x", "3:x"), "damping": 0.1 * k},
        "receptance": {
            "freq_hz": [0.1, 0.2, 0.3], "stiffness": k, "mass": m, "loss_factor": 0.01, "outputs": [0, 1],
            "inputs": [2],
        },
        "receptance (sparse)": {
            "freq_hz": [0.1, 0.2, 0.3], "stiffness": sparse.csr_array(k), "mass": sparse.csr_array(m), "outputs": [1],
            "structural_damping": sparse.csr_array(0.01 * k), "inputs": [2], "method": "krylov", "full_output": True,
        },
        "from_triangle": {"matrix": np.triu(k + 1)},
        "assemble": {"a": c["a"], "b": c["b"], "joint": c["joint"], "dofs_a": [1], "dofs_b": [0]},
        "Joint": {"stiffness": [6e5, 5e3], "damping": [20, 1.5], "dofs": ["y", "theta"]},
        "rigid_offset": {"dofs": ["x", "y", "rz"], "offset": [0.1, 0.0, 0.2]},
        "SpringLaw": {"k": 2000.0, "c": 3.0},
        "StandardLinearSolid": {"k": 1e3, "k_m": 5e2, "tau": 0.01},
        "FractionalZener": {"k": 1e3, "k_m": 5e2, "tau": 0.01, "alpha": 0.5},
        "PowerLaw": {"k": 1e3, "k_a": 5e2, "alpha": 0.5},
        "LawJoint": {"laws": {"x": jf.SpringLaw(2000.0, 3.0), "y": jf.PowerLaw(1e3, 5e2, 0.5)}},
        "LawField": {"name": "k", "kind": "stiffness"},
        "FunctionLaw": {
            "function": _spring, "derivatives": _slope, "fields": (jf.LawField("k", "stiffness"),), "values": [1e3],
        },
        "Unknown": {"value": 70e9, "std": 1e9, "lower": 0.0, "upper": 1e12},
        "AddedMass": {"dofs": ("1:x",), "mass": 0.1},
        "GroundSpring": {"dof": "1:x", "stiffness": 10.0, "damping": 0.1},
        "Substructure": {"source": c["a"], "joint": ("2:x",)},
        "Assembly": {"a": substructures[0], "b": substructures[1], "joint": law},
        "PlacedJoint": {"joint": law, "j": ("A/2:x",), "k": ("B/1:x",)},
        "Alike": {"joints": ("left", "right"), "spread": 0.1},
    }  # fmt: skip


def _spring(freq_hz: Any, values: Any) -> Any:
    return np.sum(values) + 0j * freq_hz


def _slope(freq_hz: Any, values: Any) -> Any:
    return np.ones((len(values), len(freq_hz))) + 0j


def _identification(arrays: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Fits and what prepares them."""
    c = _chains()
    gamma = jf.pollute(c["gamma"], 0.01, seed=1)
    freq = c["freq"]
    positions = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]).repeat(3, axis=0)
    point = jf.virtual_point(positions, np.tile(np.eye(3), (4, 1)), [0.05, 0.05, 0.05])
    rng = np.random.default_rng(4)
    rigid = point.modes @ (rng.standard_normal((4, 6, 6)) + 3 * np.eye(6)) @ point.modes.T + 0j
    both = np.zeros((4, 24, 24), complex)
    both[:, :12, :12] = both[:, 12:, 12:] = rigid + 0.1 * np.eye(12)
    both[:, :12, 12:] = both[:, 12:, :12] = 0.1 * rigid
    channels = [jf.io.Channel(node, f"+{axis}") for node in (1, 2, 3, 4) for axis in "xyz"]
    places = {node: positions[3 * (node - 1)] for node in (1, 2, 3, 4)}
    all_channels = (*channels, *(jf.io.Channel(10 + one.node, one.direction) for one in channels))
    coordinates = {**places, **{10 + node: place + 0.5 for node, place in places.items()}}
    frfs = jf.io.FrfSet(np.arange(1.0, 5.0), all_channels, all_channels, both, coordinates=coordinates)
    assembly = jf.Assembly(
        jf.Substructure(c["a"], ("2:x",)), jf.Substructure(c["b"], ("1:x",)),
        jf.LawJoint({"x": jf.SpringLaw(1900.0, 3.0)}),
    )  # fmt: skip
    fit = {"freq_hz": freq, "gamma": gamma, "dofs": ["x"], "bands": (1.0, 9.0)}
    mean = {"freq_hz": freq, "measured": gamma, "dofs": ["x"], "bands": (1.0, 9.0)}
    first = c["first"].dynamic_stiffness(freq)
    found = jf.identify(freq, gamma, ["x"], noise=0.01)
    time = np.arange(2000) / 50
    ringing = np.exp(-0.05 * time) * np.cos(20 * time) + 1e-4 * np.random.default_rng(1).normal(size=time.size)
    decay = jf.DecayRecord(time, ringing[:, None], ["A/1:x"], "displacement")
    again = jf.identify(freq, jf.pollute(c["gamma"], 0.01, seed=2), ["x"], noise=0.01)
    cross = jf.Joint([[6e5, 5e3], [5e3, 5e3]], dofs=["y", "rz"])
    return {
        "identify": fit,
        "identify_band_mean": {**mean, "method": "ismm", "alpha": c["alpha"], "k_initial": first},
        "identify_band_mean (decoupling)": {
            **mean, "measured": c["whole"][:, :1, 3:], "method": "decoupling-rs", "h_a": c["h_a"], "h_b": c["h_b"],
            "dofs_j": [1], "dofs_k": [0], "dofs_r": [0], "dofs_s": [1],
        },
        "identify (laws)": {**fit, "joint": jf.LawJoint({"x": jf.SpringLaw(1500.0, 2.0)}), "noise": 0.01},
        "fit_to_dict": {"fit": found},
        "fit_from_dict": {"content": jf.fit_to_dict(found)},
        "save": {"fit": found, "path": "fit.json"},
        "load": {"path": str(jf.save(found, Path("sound_fit.json").absolute()))},
        "cards": {"fit": found, "program": "nastran", "nodes": [1, 2]},
        "plot": {"fit": found},
        "write_report": {"fit": found, "path": "fit.html"},
        "FreeBody": {"h": np.full((3, 1, 1), 0.5), "dofs": ["x"]},
        "BodyLink": {"joint": jf.Joint([3.0], dofs=["x"]), "first": ["A/x"], "second": ["B/x"]},
        "couple_bodies": {
            "freq_hz": [1.0, 2.0, 3.0], "bodies": {name: jf.FreeBody(np.full((3, 1, 1), 0.5), ["x"]) for name in "AB"},
            "links": [jf.BodyLink(jf.Joint([3.0], dofs=["x"]), ["A/x"], ["B/x"])],
            "responses": ["B/x"], "forces": ["A/x"],
        },
        "plan": {
            "assembly": assembly, "freq_hz": freq, "responses": ["A/1:x", "B/2:x"], "forces": ["A/1:x", "B/2:x"],
            "targets": ["k_x"], "budget": 3.0, "sensor_mass": 0.01, "hits": ["B/2:x"],
        },
        "plan_joint_frfs": {
            "freq_hz": freq, "gamma": c["gamma"], "joint": jf.Joint([2000.0], [3.0], ["x"]), "floor": 1e-3,
            "biased": 1.01 * c["gamma"],
        },
        "write_plan": {
            "plan": jf.plan_joint_frfs(freq, c["gamma"], jf.Joint([2000.0], [3.0], ["x"])), "path": "plan.html",
            "command": "",
        },
        "expected_half_width": {"number": 5, "spread": 0.1, "error": 0.02, "probability": 0.9},
        "assemblies_needed": {"half_width": 0.3, "spread": 0.1, "error": 0.02, "probability": 0.9},
        "fit_amplitude_laws": {
            "amplitude": [1e-6, 2e-6, 4e-6], "stiffness": [1e6, 9e5, 8e5], "loss_factor": [0.01, 0.02, 0.03],
            "stiffness_error": [1e3] * 3, "loss_factor_error": [1e-3] * 3, "laws": ["constant", "power"],
            "probability": 0.9,
        },
        "Drive": {"held": "response", "level": 1e-3, "channel": "A/1:y", "quantity": "velocity"},
        "levels": {"fits": [found, again], "drives": [jf.Drive("joint", 1e-3, "x")] * 2, "laws": ["constant"],
                   "labels": ["a", "b"], "probability": 0.9},
        "Backbone": {
            "channel": "A/1:x", "freq_hz": [2.0, 1.9], "amplitude": [1e-3, 2e-3], "damping": [0.01, 0.02],
            "freq_error": 0.002, "damping_error": 0.1, "labels": ["a", "b"],
        },
        "backbone_levels": {
            "whole": assembly, "backbone": jf.Backbone("A/1:x", [2.0, 1.9], [1e-3, 2e-3], damping=[0.01, 0.02]),
            "dof": "x", "laws": ["constant"], "probability": 0.9,
        },
        "DecayRecord": {
            "time": decay.time, "signals": decay.signals, "sensors": ["A/1:x"], "motion": "displacement",
        },
        "decay_of_mode": {"record": decay, "freq_hz": 3.2, "bandwidth": 2.0, "start": 1.0, "ratio": 1.4},
        "decay_levels": {
            "whole": assembly, "decays": jf.decay_of_mode(decay, 3.2), "channels": {"A/1:x": "A/1:x"}, "dof": "x",
            "errors": (0.01, 0.02), "laws": ["constant"], "probability": 0.9,
        },
        "write_levels": {"found": jf.levels([found], [jf.Drive("joint", 1e-3, "x")]), "path": "levels.html"},
        "pool": {"fits": [found, again], "common": 0.01, "parameters": ["k_x"], "probability": 0.9},
        "transfer": {"fits": [found, again], "parameters": ["k_x"], "spread": 0.05},
        "write_pool": {"pooled": jf.pool([found, again]), "path": "pool.html"},
        "identify_realisations": {"freq_hz": freq, "gammas": [gamma, gamma], "dofs": ["x"]},
        "identify_model": {
            "freq_hz": freq, "h": jf.pollute(c["whole"], 0.01, seed=2)[:, [0, 3]][:, :, [0, 3]], "assembly": assembly,
            "responses": ["A/1:x", "B/2:x"], "forces": ["A/1:x", "B/2:x"], "noise": 0.01,
        },
        "check_frfs": {"freq_hz": freq, "h": gamma, "names": ["j:x", "k:x"]},
        "check_frfs (transform)": {
            "freq_hz": freq, "h": gamma, "responses": ["1:x", "2:x"], "forces": ["3:x", "4:x"],
            "transform": (np.eye(2), np.eye(2)), "dofs": ["x"], "fix": ["gain", "sign"],
        },
        "estimate_noise": {"freq_hz": freq, "h": gamma, "max_poles": 6},
        "estimate_noise (coherence)": {
            "freq_hz": freq, "h": gamma, "coherence": np.full(gamma.shape, 0.98), "averages": 8,
        },
        "smooth_frfs": {"freq_hz": freq, "h": gamma, "max_poles": 6},
        "elastic_centre": {"joint": cross},
        "virtual_point": {
            "positions": positions, "directions": np.tile(np.eye(3), (4, 1)), "point": [0.05, 0.05, 0.05],
        },
        "virtual_points": {"side_j": point, "side_k": point},
        "virtual_interface": {"side_j": point, "side_k": point},
        "append_virtual_point": {"h": rigid, "channels": list(range(12)), "point": point},
        "sensor_consistency": {"h": rigid, "point": point},
        "impact_consistency": {"h": rigid, "point": point},
        "channel_geometry": {"channels": channels, "coordinates": places},
        "multi_point_compliance": {"gamma": both, "side_j": point, "side_k": point, "rank": 6},
        "multi_point_stiffness": {"gamma": both, "side_j": point, "side_k": point},
        "interface": {
            "points_j": [1, 2], "points_k": [3, 4], "dofs": ["y", "rz"],
            "coordinates": {n: np.array([0.02 * n, 0, 0]) for n in (1, 2, 3, 4)}, "bending_stiffness": 2000.0,
        },
        "places_of_nodes": {"frfs": frfs, "nodes_j": [1, 2, 3, 4], "nodes_k": [11, 12, 13, 14]},
        "joint_channels": {
            "frfs": frfs, "places": jf.places_of_nodes(frfs, [1, 2, 3, 4], [11, 12, 13, 14]), "at": [0.3, 0.3, 0.3],
        },
        "ChannelPlace": {"channel": channels[0], "side": "j"},
        "Channel": {"node": 1, "direction": "+y"},
        "FrfSet": {
            "freq_hz": np.arange(1.0, 5.0), "responses": tuple(channels), "excitations": tuple(channels), "h": rigid,
        },
        "merge_frfs": {"sets": [frfs]},
        "SetUps": {
            "names": ["monday", "tuesday"], "of": [[0, 1], [0, 1]], "gain": 0.01, "common_gain": 0.01,
            "repeats": [[0, 0, 1]], "repeated": np.ones((4, 1)),
        },
    }  # fmt: skip


def _solids() -> dict[str, dict[str, Any]]:
    """Bricks and bolts."""
    aluminium = jf.Material(70e9, 0.33, 2700.0)
    block = jf.brick_beam(1.0, 1.0, 1.0, aluminium, divisions=(1, 1, 2))
    mesh = block.mesh
    bricks = {"nodes": mesh.nodes, "elements": mesh.elements}
    divisions = jf.LapDivisions(across=4, layers=1, rings=1, circles=4, head=1, nut=1)
    lap = jf.bolted_lap((0.05, 0.05), divisions=divisions)
    return {
        "Material": {"youngs_modulus": 70e9, "poisson": 0.33, "density": 2700.0, "loss_factor": 0.01},
        "Hole": {"position": 0.5, "radius": 0.1, "patch_radius": 0.2},
        "brick_beam": dict(length=1.0, width=1.0, height=1.0, material=aluminium, divisions=(1, 1, 2)),
        "Mesh": bricks,
        "brick_quality": bricks,
        "assemble_bricks": {**bricks, "materials": aluminium},
        "element_matrices": {"coordinates": mesh.nodes[mesh.elements], "materials": aluminium},
        "solid_model": {"mesh": mesh, "materials": aluminium, "clamped": [0, 1]},
        "Patch": {"point": np.zeros(3), "nodes": np.array([0, 1, 2, 3], np.int32)},
        "interpolation": {"mesh": mesh, "points": [[0.5, 0.0, 0.0]], "directions": "xyz"},
        "preload_force": {"tensile_area": 36.6e-6, "proof_strength": 640e6, "share": 0.75},
        "Bolt": {},
        "LapDivisions": dict(across=4, layers=1, rings=1),
        "ContactLaw": {"friction": 0.3},
        "bolted_lap": {"lengths": (0.05, 0.05), "divisions": divisions},
        "preload": {"lap": lap, "force": 5e3, "max_iterations": 4},
    }


def _files(folder: Path) -> dict[str, dict[str, Any]]:
    """Files in and out; those that are read are there."""
    rng = np.random.default_rng(5)
    h = rng.standard_normal((5, 2, 2)) + 1j * rng.standard_normal((5, 2, 2))
    channels = (jf.io.Channel(1, "+x"), jf.io.Channel(2, "-y"))
    frfs = jf.io.FrfSet(np.arange(10.0, 60.0, 10.0), channels, channels, h)
    jf.io.write_uff(folder / "a.uff", frfs)
    jf.io.write_npz(folder / "a.npz", frfs)
    (folder / "table.csv").write_text("channel,side\n1:x,j\n2:y,k\n")
    masses = 'model = "chain"\nmasses = [3.0, 2.0]\nstiffness = [2000.0, 0.0]\ndamping = [3.0, 0.0]\n'
    parts = f'[A]\n{masses}joint = ["2:x"]\n[B]\n{masses}joint = ["1:x"]\n[[joint.law]]\ndof = "x"\nlaw = "spring"\n'
    (folder / "assembly.toml").write_text(f'{parts}[channels]\n"1:+x" = "A/1:x"\n"2:-y" = "B/2:x"\n')
    (folder / "part.toml").write_text(masses + 'joint = ["1:x"]\n')
    law = jf.LawJoint({"x": jf.SpringLaw(2000.0, 3.0)})
    jf.write_joint(folder / "joint.toml", law)
    first = jf.study("3.1", folder / "study", 2, design=jf.StudyDesign(estimators=["ismm"]), jobs=1)
    written = {name: {"path": folder / f"out.{name}", "frfs": frfs} for name in ("uff", "npz", "csv", "hdf5", "mat")}
    (folder / "time.csv").write_text("time [s],A/1:x [m/s^2]\n0.0,1.0\n0.1,0.5\n0.2,0.25\n")
    row = {"Grouping": 1, "Position_1": 10.0, "Position_2": 0.0, "Position_3": 0.0}
    table = [row | {f"Direction_{i}": float(i == axis) for i in (1, 2, 3)} for axis in (1, 2)]
    return {
        "read_uff": {"path": folder / "a.uff"},
        "read_frfs": {"paths": folder / "a.npz"},
        "read_time_record": {"path": folder / "time.csv", "rate": 10.0, "unit": "g"},
        "from_pyfbs": {
            "test": frfs.freq_hz,
            "frf": h,
            "df_chn": table,
            "df_imp": table,
            "unit": "m/s^2/N",
            "position_unit": "mm",
            "sides": {1: "j"},
            "coherence": np.full(h.shape, 0.9),
        },
        "from_sdynpy": {"array": jf.io.to_sdynpy(frfs), "unit": "m/N"},
        "to_sdynpy": {"frfs": frfs},
        "from_escdf": {"dataset": jf.io.to_escdf(frfs)},
        "to_escdf": {"frfs": frfs},
        "measured_assembly": {"path": folder / "assembly.toml", "frfs": frfs},
        "read_channel_table": {"path": folder / "table.csv"},
        "read_joint": {"path": folder / "joint.toml"},
        "read_part": {"path": folder / "part.toml"},
        "write_joint": {"path": folder / "written.toml", "joint": law},
        "study": {"case": "3.1", "out": folder / "another", "realisations": 2, "jobs": 1},
        "read_study": {"folder": first.folder},
        "merge_studies": {"parts": [first.folder], "out": folder / "merged"},
        "study (design)": {
            "case": "3.1",
            "out": folder / "designed",
            "realisations": 3,
            "part": range(2),
            "jobs": 1,
            "design": jf.StudyDesign({"noise": [0.01, 0.05]}, estimators=["ismm"]),
        },
        "StudyDesign": {"factors": {"noise": [0.01, 0.05]}, "estimators": ["ismm"]},
        "FrfMapping": {"freq_hz": "f", "h": "H"},
        "write_frfs": {"path": folder / "by_suffix.npz", "frfs": frfs},
        **{f"write_{name}": arguments for name, arguments in written.items()},
    }
