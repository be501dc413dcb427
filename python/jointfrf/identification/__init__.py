"""From measured FRFs to a `JointFit`.

In reading order: `identify` (the door), `prepare` (what all methods check), `compliance_fit` (maximum likelihood) and
`band_means` (the mean of K*(w) over bands), `joint_fit` (the result). The methods that compute K*(w) line by line are
in `jointfrf.substructuring.methods`. Beside them `realisations` (many sets of FRFs), `sensitivity` and `monte_carlo`.
"""
