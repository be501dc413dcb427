"""Cases of kind `modelled-joint`: a joint of any laws, from FRFs at any points, given models of the substructures.

keys      the keys of its case.toml
read      from case.toml to a case
compute   realisations of the measurement, each fitted
tables    parameters beside their bound, the stiffness over frequency, the residual test
figures   stiffness and loss factor over frequency, FRFs measured and fitted
kind      the kind
"""
