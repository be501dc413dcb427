"""FRFs as data: sets of them, their channels, bands, noise and error measures."""
