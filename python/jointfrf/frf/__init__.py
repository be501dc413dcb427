"""FRFs as data.

frf_set       sets of measured FRFs with names of channels; merge puts several together
bands         bands, means over them, errors of peaks in them; lines in pieces
noise         pollution
noise_model   noise of measured FRFs, from residuals and differences of reciprocal entries: noise_parts, entry_groups
smoothing     rational functions through measured FRFs: rational_fit
quantiles     medians and quantiles of small arrays

Numbers without a derivation beside them are judged by what they recover: levels, floors, hum and correlation in
tests/python/unit/test_noise_model.py and test_smoothing.py, joints in tests/accuracy.
"""
