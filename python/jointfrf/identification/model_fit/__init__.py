"""A joint from any FRFs of the assembly, by maximum likelihood, given models or FRFs of the substructures.

unknown          a number of a model that is known with an uncertainty
substructure     A or B: a model, a function that builds one, or FRFs
attachments      masses and springs to the ground at points of the assembly
assembly         substructures, joint and attachments: FRFs of the whole
reduced          a substructure reduced once, its FRFs and their derivatives for other values of its unknowns
unknowns         all parameters of a fit in one vector, and the coordinates in which they are sought
prediction       FRFs between channels, and their derivatives -H dZ H
likelihood       residuals, priors, information
noise_about      noise of measured FRFs about fitted ones
minimum          Levenberg-Marquardt steps inside bounds
starts           values to start from: K* of the lines, or many trials
profile          intervals by profile likelihood
residual_check   whether the residual is noise, and if not, where in frequency and in which channel
directions       what the data do not hold, by its direction among the parameters
fit              the steps of a fit in their order
describe         notes and warnings
model_fit        the result
identify_model   the door
realisations     many sets of FRFs of one assembly
"""
