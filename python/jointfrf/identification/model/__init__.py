"""The likelihood of any FRFs of an assembly, given models or FRFs of its substructures.

In reading order: `substructure` and `assembly` (what is given), `prepare` (arguments into a problem), `reduced`
(substructures reduced once), `prediction` (FRFs and their derivatives), `likelihood`, `starts`, `fit`, `realisations`.
"""
