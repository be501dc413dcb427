"""Checks of measured FRFs before a fit: bad lines, bad channels, quantity, sign, gain, delay.

Limits beside the code are those that FRFs without errors keep to with noise of up to 10 % of any kind:
`tests/accuracy/checks.py` counts false alarms and errors found (docs/checks.md).
"""
