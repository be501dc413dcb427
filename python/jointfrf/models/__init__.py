"""Models of substructures and their receptances.

matrices      matrices of a model as given, and its responses and forces
model         matrices with names of DOFs, assemblies, chains
points        models with places of nodes and reference points
facts         checks of matrices: mass, rigid motions, natural frequencies
beam          plane beams
regions       lines and faces on which joints act per length or area
plate         rectangular plates in bending
receptance    the choice of a method, and direct solutions
modal         sums of modes, computed or measured; separate rigid-body modes
krylov        reduction to solutions at a few frequencies
factors       factors of matrices and the order of elimination
"""
