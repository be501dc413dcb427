"""Which reading of the words "5 % noise" explains the printed values of the thesis best: docs/noise-readings.md.

    tests/accuracy/run readings                                   all cases, lines 0.15, 1, 2, 3, 5 Hz apart
    tests/accuracy/run readings 3.2 --spacing 5 --level 0.2,0.1   one case, at a fifth and a tenth of the printed level

`reading` says what a reading is, `printed_values` which values are printed, `study` computes realisations of every
reading, `score` compares them with the printed values, `ranking` adds up and makes tables.
"""
