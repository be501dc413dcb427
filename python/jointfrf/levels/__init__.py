"""Joints whose stiffness and damping depend on amplitude.

friction        stiffness in the first harmonic of Jenkins, four-parameter Iwan and Bouc-Wen elements
amplitude_laws  laws fitted to k(a) and eta(a), with intervals, and the choice between them
"""
