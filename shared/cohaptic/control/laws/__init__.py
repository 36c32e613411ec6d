"""The laws of the wire: one class in one file each, with its force, its gains and its stiffness."""
