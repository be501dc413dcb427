"""Models of substructures and their receptances.

matrices      the matrices of a model as given, and where it is driven and observed
model         matrices with names of DOFs, assemblies, chains
points        models with places of nodes and reference points
facts         what shows that matrices are the right ones
beam          plane beams
regions       lines and faces on which joints act per length or area
plate         rectangular plates in bending
receptance    the choice of a method, and direct solutions
modal         sums of modes, computed or measured; rigid-body modes apart
krylov        reduction to solutions at a few frequencies
factors       factors of matrices and the order of elimination
"""
