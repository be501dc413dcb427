"""Coupling of substructures, and the inverse, from FRFs to the joint; one function for each equation of the thesis."""
