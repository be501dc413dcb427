"""Cases: published ones and those of one's own, from a `case.toml` to tables, figures and a report.

catalogue      finding cases, reading one, running one
kind           what a kind of case consists of, and what every case says
kinds          the kinds there are: one line each
definitions    what several kinds read: frequencies, joint, bands, noise, observed FRFs
comparison     expected natural frequencies, and the table that compares them
fitting        the fit in the compliance domain, as cases call it
workers        processes that share the work
known_joint/   two simulated substructures and a joint of known parameters
bolted_lap/    a lap joint with a preloaded bolt of solid elements
modelled_joint/  a joint of any laws, from FRFs at any points, with models of the substructures

A new kind of case is a folder with a `CaseKind`, and one line in `kinds`.
"""
