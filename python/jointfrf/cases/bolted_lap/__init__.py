"""A lap joint with a preloaded bolt of solid elements: measured, identified, and used again with another beam.

keys         what the keys of its files mean
read         the case as data
measurement  the measured points, and how the six DOFs of both sides follow
frfs         FRFs: of the preloaded solid model, of the beams by themselves
routes       from measured FRFs to K*(w) by several routes, and to constants by two estimators
resonances   resonances of the tip, and errors of regenerated ones
compute      all of these, without noise and with it
tables       the tables
summary      a few sentences
figures      the figures
kind         the six parts of the kind, for the registry
"""
