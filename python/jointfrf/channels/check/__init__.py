"""A look at measured FRFs before a fit: bad lines, bad channels, and what the numbers say of quantity, sign and gain."""
