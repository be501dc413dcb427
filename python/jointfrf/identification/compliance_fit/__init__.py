"""The maximum-likelihood fit of a joint in the compliance domain.

In reading order: `joint_terms` (K* as a sum of parameters), `least_squares` (one problem and its minimiser),
`initial_parameters` (where it begins), `linearised` (the problem from FRFs about an estimate of the true ones),
`line_selection` (weights of the lines), `group_fit` (the iteration), `groups` (DOFs that are fitted separately),
`estimator` (the door), `intervals` (covariance of the parameters). The noise model is in `jointfrf.frf.noise_estimate`.
"""
