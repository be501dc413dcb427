"""The likelihood of FRFs between all joint DOFs, linearised on the manifold of FRFs that fit a joint.

In reading order: `coordinates` (compliance of springs or laws as a function of coordinates), `transforms` and
`interface_frfs` (from channels to joint DOFs), `prepare` (arguments into a problem), `on_manifold` (FRFs that fit a
joint), `line_forms` (one problem on every line), `starts`, `group_fit` (the iteration), `unknown_cross` (where cross
terms are unknown), `estimate` (all groups, the strategies), `uncertainty`, `beyond_noise` (sides that are not rigid,
parts of the band), `fit` (all of it).
"""
