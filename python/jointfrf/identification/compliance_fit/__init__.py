"""The maximum-likelihood fit of a joint, linearised on the manifold of FRFs that fit it.

In reading order: `joint_terms` (K* as a sum of parameters, and the coordinates of its compliance), `transforms`,
`channel_noise` and `prepare` (arguments into a problem), `from_nothing` (what is refused), `interface_frfs` (from
channels to joint DOFs, with noise), `line_forms` (one problem and its minimiser), `diagonal_minimum` (its lowest
minimum), `manifold` (FRFs that fit a joint), `starts` (where it begins), `likely_m` (M of a stiff joint), `group_fit`
(the iteration), `compliance_lines` and `unknown_cross` (the fit where cross terms of C are unknown), `estimator` (all
groups), `damping_choice`, `intervals` (uncertainty), `rigidity` and `channel_jackknife` (sides that are not rigid),
`band_parts` (joints of parts of the band), `misfit` (the residual against noise), `fit` (all of it), `describe` (notes
and warnings). Smooth FRFs and the noise model come from `jointfrf.frf`.
"""
