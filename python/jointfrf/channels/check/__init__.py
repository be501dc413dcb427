"""Checks of measured FRFs before a fit: bad lines, bad channels, quantity, sign, gain, delay."""
