"""Files of FRFs as other programs write them."""

import numpy as np
import scipy.io

from jointfrf.io import Channel, FrfSet

FREQ_HZ = np.arange(10.0, 60.0, 10.0)


def frf_set(quantity="accelerance", **more):
    """Five lines, three responses, two excitations, no two values alike."""
    random = np.random.default_rng(5)
    h = random.normal(size=(5, 3, 2)) + 1j * random.normal(size=(5, 3, 2))
    responses = tuple(Channel.parse(name) for name in ("101:+x", "102:-y", "103:+z"))
    excitations = tuple(Channel.parse(name) for name in ("101:+x", "201:+y"))
    return FrfSet(FREQ_HZ, responses, excitations, more.pop("h", h), quantity, **more)


def full_set():
    """The same with all that a set may know, one FRF missing."""
    given = frf_set()
    h = given.h.copy()
    h[:, 2, 1] = np.nan
    coherence = np.random.default_rng(6).uniform(0.5, 1, h.shape)
    coherence[:, 0, 1] = np.nan
    coherence[:, 2, 1] = np.nan
    places = {101: np.array([0.0, 0.1, 0.2]), 102: np.array([1.0, 1.1, 1.2])}
    return frf_set(h=h, coherence=coherence, averages=8, coordinates=places)


def names(channels):
    return [str(channel) for channel in channels]


def structure_of_testlab(
    frfs, *, label="g/N", factor=0.0, info="", type_="FRF", values=None, step=None
):  # fmt: skip
    """A structure as Simcenter Testlab exports one: a column for each function; factor 0: by the label, None: none."""
    factor = (1 / 9.80665 if label.startswith("g") else 1.0) if factor == 0.0 else factor
    values = frfs.h if values is None else values
    pairs = [(i, j) for i in range(len(frfs.responses)) for j in range(len(frfs.excitations))]
    side = [
        {
            "label": np.array([f"bar:{channels[pair[k]].node}" for pair in pairs], dtype=object),
            "direction": np.array([channels[pair[k]].direction.upper() for pair in pairs], dtype=object),
        }
        for k, channels in enumerate((frfs.responses, frfs.excitations))
    ]
    return {
        "x_values": {
            "start_value": frfs.freq_hz[0],
            "increment": frfs.freq_hz[1] - frfs.freq_hz[0] if step is None else step,
            "number_of_values": float(frfs.freq_hz.size),
            "quantity": {"label": "Hz"},
        },
        "y_values": {
            "values": np.stack([values[:, i, j] for i, j in pairs], axis=1),
            "quantity": {
                "label": label,
                "info": info,
            }
            | (
                {}
                if factor is None
                else {"unit_transformation": {"factor": factor, "offset": 0.0, "log_reference": 1.0}}
            ),
        },
        "function_record": {"type": type_, "primary_channel": side[0], "reference_channel": side[1]},
    }


def write_mat(path, *, compressed=True, **fields):
    scipy.io.savemat(path, fields, do_compression=compressed)
    return path


def write_mat73(path, **fields):
    """A file of MATLAB 7.3: axes reversed, texts as numbers, cells as references, complex as compounds."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        cells = file.create_group("#refs#")
        for name, value in fields.items():
            _put73(h5py, file, cells, name, value)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    return path


def _put73(h5py, group, cells, name, value):
    if isinstance(value, dict):
        inside = group.create_group(name)
        inside.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, each in value.items():
            _put73(h5py, inside, cells, key, each)
    elif isinstance(value, list) and all(isinstance(each, dict) for each in value):
        inside = group.create_group(name)
        inside.attrs["MATLAB_class"] = np.bytes_("struct")
        for field in value[0]:
            references = _references(h5py, cells, [each[field] for each in value])
            inside.create_dataset(field, data=references, dtype=h5py.ref_dtype)  # without a class, unlike cells
    elif isinstance(value, str):
        data = group.create_dataset(name, data=np.array([[ord(letter)] for letter in value], np.uint16))
        data.attrs["MATLAB_class"] = np.bytes_("char")
    elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        data = group.create_dataset(name, data=_references(h5py, cells, value), dtype=h5py.ref_dtype)
        data.attrs["MATLAB_class"] = np.bytes_("cell")
    else:
        array = np.atleast_2d(np.asarray(value)).T
        if np.iscomplexobj(array):
            both = np.zeros(array.shape, [("real", "f8"), ("imag", "f8")])
            both["real"], both["imag"] = array.real, array.imag
            array = both
        data = group.create_dataset(name, data=array)
        data.attrs["MATLAB_class"] = np.bytes_("double")


def _references(h5py, cells, values):
    references = []
    for each in values:
        _put73(h5py, cells, cells, key := f"c{len(cells)}", each)
        references.append(cells[key].ref)
    return np.array(references, h5py.ref_dtype).reshape(-1, 1)


def write_sdynpy(path, frfs, function_type=4):
    """The array and the function type that `NDDataArray.save` of sdynpy 0.18 writes."""
    codes = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}
    n, shape = frfs.freq_hz.size, frfs.h.shape[1:]
    place = [("node", "uint64"), ("direction", "int8")]
    comments = [(f"comment{i}", "<U80") for i in range(1, 6)]
    data = np.zeros(
        shape,
        [("abscissa", "f8", (n,)), ("ordinate", "c16", (n,)), *comments, ("coordinate", place, (2,))],
    )
    data["abscissa"] = frfs.freq_hz
    data["ordinate"] = np.moveaxis(frfs.h, 0, -1)
    for i in range(shape[0]):
        for j in range(shape[1]):
            for k, channel in enumerate((frfs.responses[i], frfs.excitations[j])):
                data["coordinate"][i, j, k] = channel.node, channel.sign * codes[channel.axis]
    np.savez(path, data=data, function_type=function_type)
    return path


GIVEN = frf_set()
#: The same as named arrays, as other programs save them.
FIELDS = {
    "f": FREQ_HZ,
    "H": GIVEN.h,
    "responses": names(GIVEN.responses),
    "excitations": names(GIVEN.excitations),
    "unit": "m/s^2/N",
}
