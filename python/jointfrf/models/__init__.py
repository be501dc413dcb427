"""Models of substructures: lumped chains, beams, matrices of one's own; how they become receptances."""
