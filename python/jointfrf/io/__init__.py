"""Measured FRFs: what a file holds (`FrfSet`), how it is read (`read_uff`) and written (`write_uff`)."""

from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.io.uff import read_uff
from jointfrf.io.uff_write import write_uff

__all__ = ["Channel", "FrfSet", "read_uff", "write_uff"]
