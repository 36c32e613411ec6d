"""Linear elastic solids of tetrahedra: factored once, exact near contacts, smooth far from them."""
