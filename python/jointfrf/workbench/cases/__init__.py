"""Published cases and your own: from a `case.toml` to tables, figures and a report.

catalogue      the list of cases, reading of a case, and the kinds of cases
run            computation of a case and its report
kind           parts of a kind of case, shared by cases and studies
keys           keys of several kinds of cases: frequencies, joint, bands, noise
comparison     comparison of results with `expected.toml`
workers        worker processes
known_joint/   two simulated substructures and a joint of known parameters
bolted_lap/    a lap joint with a preloaded bolt of solid elements
modelled_joint/  a joint of any laws, from FRFs at any points, with models of the substructures

A new kind of case is a folder with a `KIND`, and one line in `jointfrf.choices`.
"""
