"""The likelihood of any FRFs of an assembly, given models or FRFs of its substructures.

In reading order:

substructure   A or B: a model, a function that builds one, or FRFs, with numbers that are known with an uncertainty
assembly       substructures, joint, masses and springs attached: FRFs of the whole
model_error    errors of modal matrices that no unknown describes
reduced        a substructure reduced once, its FRFs and their derivatives for other values of its unknowns
prediction     all parameters in one vector; FRFs between channels, and their derivatives -H dZ H
joint_motion   how the joint of an assembly found moves on each line, and what each line adds to the fit
likelihood     residuals, priors, information
starts         values to start from: the best of many trials
evidence       the level of the errors of the models, by the evidence of the FRFs
uncertainty    scatter of the gradient between lines, blocks and hits; channels a little off
fit            the steps of a fit in their order; what the data do not determine
next_channels  what to measure next
prepare        arguments into a problem
channel_map    signs and exchanges of channels that the FRFs show
realisations   many sets of FRFs of one assembly
"""
