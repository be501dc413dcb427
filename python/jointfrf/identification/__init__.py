"""From measured FRFs to a `JointFit`.

In reading order: `identify` (the door), `prepare` (arguments into a problem), `fit` (numbers), `describe` (notes and
warnings), `joint_fit` (the result). `compliance_fit` holds the maximum-likelihood fit; the methods that compute K*(w)
line by line are in `jointfrf.substructuring.methods`. Beside them `sensitivity` and `monte_carlo`.
"""
