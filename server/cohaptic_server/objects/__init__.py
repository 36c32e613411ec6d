"""Objects from files: from a mesh file to a body that can be simulated in every tick."""
