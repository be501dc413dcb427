"""Checks of measured FRFs before a fit: wrong lines and channels, quantity, sign, gain, delay.

FRFs without errors keep to the limits in the code with up to 10 % noise of any kind. `tests/accuracy/checks.py` counts
false alarms and detected errors (docs/checks.md).
"""
