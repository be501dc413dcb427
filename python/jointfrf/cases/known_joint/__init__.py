"""A kind of case: two substructures and a joint of known parameters, identified from polluted FRFs."""
