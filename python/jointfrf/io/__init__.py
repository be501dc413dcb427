"""Measured FRFs: what a file holds (`FrfSet`) and how it is read (`read_uff`)."""

from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.io.uff import read_uff

__all__ = ["Channel", "FrfSet", "read_uff"]
