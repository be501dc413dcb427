"""A bolted lap joint from its solid model to the identified joint: case study 2 of chapter 4.

`case_file` reads the case, `measurement` turns measured translations into the six DOFs of both sides, `study`
calculates, `tables` and `figures` show.
"""
