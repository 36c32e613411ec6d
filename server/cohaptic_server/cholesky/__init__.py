"""The sparse Cholesky factorisation: ordered, analysed, factored, and factored anew."""
