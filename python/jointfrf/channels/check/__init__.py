"""A look at measured FRFs before a fit: bad lines, bad channels, quantity, sign, gain, delay."""
