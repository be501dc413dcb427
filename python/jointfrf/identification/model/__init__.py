"""The likelihood of any FRFs of an assembly, given models or FRFs of its substructures."""
