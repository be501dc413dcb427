"""Coupling of substructures and the ways back to the joint, one equation of the thesis each."""
