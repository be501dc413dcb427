"""Studies: realisations of the noise of a case over a design of factors, on any number of workers.

`design` says which cases a study consists of, `schedule` cuts realisations into chunks, `store` keeps what they gave,
`run` puts them together; `result` reads and writes it, `summary` condenses it to a table, `figures` draws it.
"""
