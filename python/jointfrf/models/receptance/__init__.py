"""Receptance of a model: direct solution, superposition of modes, reduction by rational Krylov vectors."""
