"""The likelihood of any FRFs of an assembly, given models or FRFs of its substructures.

In reading order:

substructure   A or B: a model, a function that builds one, or FRFs, with numbers that have an uncertainty
assembly       substructures, joints, attached masses and springs: FRFs of the whole
model_error    errors of modal matrices that no unknown describes
reduced        a substructure reduced once, its FRFs and their derivatives for other values of its unknowns
prediction     all parameters in one vector; FRFs between channels, and their derivatives -H dZ H
joint_motion   motion of the joint of a fitted assembly on each line, and the contribution of each line to the fit
likelihood     residuals, priors, information
starts         initial values: the best of many trials
evidence       the level of the errors of the models, by the evidence of the FRFs
uncertainty    scatter of the gradient between lines, blocks and impacts; calibration errors of channels
fit            the steps of a fit in their order; directions that the data do not determine
next_channels  channels to measure next
prepare        arguments into a problem
channel_map    signs and exchanges of channels that the FRFs show
realisations   many sets of FRFs of one assembly
"""
