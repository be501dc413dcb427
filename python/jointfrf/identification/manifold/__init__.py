"""The likelihood of FRFs between all joint DOFs, linearised on the manifold of FRFs that fit a joint.

In reading order:

line_forms      quadratic forms of the compliance on every line, and their minimum in coordinates of a joint
coordinates     K*(w) of a joint, its compliance as a function of coordinates: springs, with cross terms, laws
transforms      from channels to joint DOFs, and non-rigid motion of the channels
interface_frfs  FRFs of channels converted to the joint DOFs, with the covariance of their noise
prepare         arguments into a problem; errors for FRFs from which no joint can be identified
on_manifold     FRFs that fit a joint: projection, forms, expected M of a stiff joint
starts          initial coordinates from the compliance of single lines
group_fit       the iteration: linearise, minimise, test
unknown_cross   the fit with unknown cross terms of C
estimate        strategies tried in order for every group of DOFs, combined
band_parts      separate fits of parts of the band
uncertainty     the likelihood linearised; variance by noise, channels and sides; intervals; test of the residual
flexible_sides  the joint without its sides, from the deformation among the channels
side_columns    flexible sides as random effects, estimated with the joint
fit             all of it: noise level, choice of damping, uncertainty

Modules shared with the likelihood of models are in `jointfrf.identification`: linearised, mixed, parameters, minimise,
profile, scatter, residual_test, noise, line_starts. Smooth FRFs and the noise model come from `jointfrf.frf`.
"""
