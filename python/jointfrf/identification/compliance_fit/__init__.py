"""The maximum-likelihood fit of a joint in the compliance domain.

In reading order: `joint_terms` (K* as a sum of parameters), `frf_noise` (what the FRFs tell of their noise),
`least_squares` (one linear problem), `linearised` (FRFs linearised about an estimate), `compliance_fit` (the
iteration), `estimator` (groups of DOFs, the door), `fit_notes` (what a user is told).
"""
