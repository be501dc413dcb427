"""Models of substructures: lumped chains, beams, matrices of the user; how they become receptances."""
