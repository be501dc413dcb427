"""Which reading of the words "5 % noise" explains the printed values of a source best.

`reading` says what a reading is, `printed_values` which values are printed, `study` computes realisations of every
reading, `score` compares them with the printed values, `ranking` adds up, `tables` shows.
"""
