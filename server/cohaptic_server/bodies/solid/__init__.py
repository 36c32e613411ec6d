"""Linear elastic solids of tetrahedra: factored once, exact near contacts, sampled far away."""
