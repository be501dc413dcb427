"""Cases: published ones and your own, from a `case.toml` to tables, figures and a report.

catalogue      find cases and read one; the kinds of cases
run            the way from a case to its results: structure, FRFs, realisations, methods, tables, figures, report
kind           the parts of a kind of case, which cases and studies share
keys           keys that several kinds have: frequencies, joint, bands, noise
comparison     the comparison of results with `expected.toml`
workers        processes that share the work
known_joint/   two simulated substructures and a joint of known parameters
bolted_lap/    a lap joint with a preloaded bolt of solid elements
modelled_joint/  a joint of any laws, from FRFs at any points, with models of the substructures

A new kind of case is a folder with a `KIND`, and one line in `jointfrf.choices`.
"""
