"""From FRFs of the assembly to the parameters of the joint."""
