"""Studies: realisations of the noise of a case over a design of factors, on any number of workers.

`design` says which cases a study consists of, `run` computes realisations in chunks and puts them together, `store`
keeps what they gave; `summary` condenses it to a table and figures, `result` reads and writes it.
"""
