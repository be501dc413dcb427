"""Two simulated substructures and a joint of known parameters: identified from noisy FRFs, many times over.

read           the case as data
keys           what the keys of its files mean
structure      a structure as the case needs it: by a model, or by its FRFs
substructures  the two structures: chain, beam, beam of bricks
from_files     the two structures: matrices and receptances in files
expected       what the source says about the case: tables, errors of regenerated FRFs
exact          FRFs without noise
methods        K*(w) line by line, by each method
study          many realisations of the noise: identified parameters
bounds         the bound of the decoupling fit
regenerate     FRFs of the assembly from identified parameters, and their errors
printed        FRFs from published parameters as they are printed, and their errors
noise_free     how exact the equations are without noise
modes          mode shapes of the assembly, and drawings of them
compute        all of these, one after the other
tables         numbers beside those of the source
summary        a few sentences
figures        the figures
kind           the six parts of the kind, for the registry
"""
