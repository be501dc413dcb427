"""Cases: published ones and your own, from a `case.toml` to tables, figures and a report.

catalogue      finding cases, reading one, running one; the kinds of cases
kind           what a kind of case consists of, and what a study asks of it
keys           keys that several kinds have, and what follows: frequencies, joint, bands, noise
comparison     computed beside expected natural frequencies; how many values of a table fit
workers        processes that share the work
known_joint/   two simulated substructures and a joint of known parameters
bolted_lap/    a lap joint with a preloaded bolt of solid elements
modelled_joint/  a joint of any laws, from FRFs at any points, with models of the substructures

A new kind of case is a folder with a `KIND`, and one line in `catalogue`.
"""
