"""A joint from any FRFs of the assembly, given models of its substructures: the door, the result, notes, warnings."""
