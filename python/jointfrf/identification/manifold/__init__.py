"""The likelihood of FRFs between all joint DOFs, linearised on the manifold of FRFs that fit a joint."""
