"""Joints whose stiffness and damping depend on amplitude.

lines           motion in the joint and weight of each line of a fit; dependence of the stiffness on amplitude
levels          tests at several levels: k(a) and eta(a), with intervals and laws
backbone        k(a) and eta(a) from frequency and damping of a mode over amplitude, by models
decay           frequency and damping of a mode over amplitude, from free decays
decay_levels    k(a) and eta(a) from free decays, by models
friction        stiffness in the first harmonic of Jenkins, four-parameter Iwan and Bouc-Wen elements
amplitude_laws  laws fitted to k(a) and eta(a), with intervals, and the choice between them
"""
