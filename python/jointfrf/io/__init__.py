"""Measured FRFs: the content of a file (`FrfSet`), and functions that read (`read_frfs`) and write it."""

from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.frf.merge import merge_frfs
from jointfrf.io.arrays import frfs_of_arrays
from jointfrf.io.channel_table import read_channel_table
from jointfrf.io.csv_file import write_csv
from jointfrf.io.file_format import FileFormat, FrfArrays, FrfMapping
from jointfrf.io.formats import read_frfs, write_frfs
from jointfrf.io.hdf5_file import write_hdf5
from jointfrf.io.mat_file import write_mat
from jointfrf.io.npz_file import write_npz
from jointfrf.io.pyfbs import PyfbsTest, from_pyfbs
from jointfrf.io.sdynpy import from_escdf, from_sdynpy, to_escdf, to_sdynpy
from jointfrf.io.time_file import TimeRecord, read_time_record
from jointfrf.io.uff import read_uff, write_uff

__all__ = [
    "Channel",
    "FileFormat",
    "FrfArrays",
    "FrfMapping",
    "FrfSet",
    "PyfbsTest",
    "TimeRecord",
    "frfs_of_arrays",
    "from_escdf",
    "from_pyfbs",
    "from_sdynpy",
    "merge_frfs",
    "read_channel_table",
    "read_frfs",
    "read_time_record",
    "read_uff",
    "to_escdf",
    "to_sdynpy",
    "write_csv",
    "write_frfs",
    "write_hdf5",
    "write_mat",
    "write_npz",
    "write_uff",
]
