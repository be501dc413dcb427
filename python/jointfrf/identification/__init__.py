"""From measured FRFs to a `Fit`: one engine with two likelihoods.

In reading order: the entry points `identify` (FRFs between all joint DOFs), `identify_model` (any FRFs of an assembly)
and `band_means` (the methods of the thesis); `prepare` and `noise` (checks and noise), `parameters` (coordinates),
`line_starts`, `minimise`, `linearised`, `scatter`, `mixed`, `profile`, `residual_test` (shared by both likelihoods),
`manifold/` and `model/` (each likelihood); `side_models` and `joint_alone` (flexible sides, with and without models);
`describe` (findings of a fit), `result` (the fit), `derived` (its functions), `fit_data` and `compliance_data` (data
of figures), `record` and `fit_cards` (files and cards).
Further modules: `realisations` (many sets of FRFs), `joint_file`, `elastic_centre`, `information_bound`, `sensitivity`
and `monte_carlo`.
"""
