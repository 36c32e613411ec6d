"""Sparse Cholesky factorisation: ordering, analysis, factorisation and refactorisation."""
