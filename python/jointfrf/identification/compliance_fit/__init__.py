"""The maximum-likelihood fit of a joint, linearised on the manifold of FRFs that fit it.

In reading order: `joint_terms` (K* as a sum of parameters, and the coordinates of its compliance), `interface_frfs`
(from channels to joint DOFs, with noise), `line_forms` (one problem and its minimiser), `manifold` (FRFs that fit a
joint), `starts` (where it begins), `group_fit` (the iteration), `estimator` (the door), `damping_choice`, `intervals`
(uncertainty), `misfit` (the residual against noise). Smooth FRFs and the noise come from `jointfrf.frf`.
"""
