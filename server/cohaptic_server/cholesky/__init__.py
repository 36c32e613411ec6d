"""The sparse Cholesky factorisation: ordering, analysis, factorisation and refactorisation."""
