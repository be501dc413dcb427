"""Studies: realisations of the noise of a case over a design of factors, on any number of workers.

`design` lists the cases of a study, `run` computes realisations in chunks and merges them, `store` keeps the estimates
in files, `summary` condenses them to a table and figures, `result` reads and writes results.
"""
