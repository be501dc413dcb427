"""FRFs as data.

frf_set       sets of measured FRFs with names of channels
setups        set-up of each FRF of a test
merge         several sets as one
bands         bands, means over them, errors of peaks in them; lines in chunks
noise         pollution
stated_noise  noise as a user states it
smoothing     smooth FRFs by rational functions with common poles, many lines in pieces
entry_groups  entries that are measured twice, are zero, or have common poles
noise_parts   relative and constant part of the noise, its correlation, outlying lines
calibration   errors of channels and set-ups that are smooth over frequency, by FRFs measured twice
cross_axis    impacts and sensors off axis, by h_pq and h_qp
moving_mass   mass of a sensor that moves from point to point, from h_pq and h_qp
noise_model   noise of measured FRFs, from residuals and differences of reciprocal entries
quantiles     medians and quantiles of small arrays

Numbers without a derivation are validated by simulated tests: levels, floors, hum and correlation in
tests/python/unit/test_noise_model.py and test_smoothing.py, joints in tests/accuracy.
"""
