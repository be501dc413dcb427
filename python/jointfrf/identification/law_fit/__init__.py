"""A joint of laws from FRFs between all joint DOFs, without models: the door, the result, notes and warnings."""
