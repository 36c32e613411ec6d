"""Objects from files: one chain of steps from a mesh file to a body that a tick can simulate.

Read in this order: `object_file.py` (the options, a table), `prepare.py` (the chain: read, check,
simplify, fill, check again), `build.py` (hold, stiffness, factor), `store/` (what is kept).

Terms:
    fill: make tetrahedra inside a closed surface (`tetrahedralise.py`, by fTetWild).
    edge: target length of a tetrahedron's edge, as a share of the bounding box's diagonal.
    part: tetrahedra with a material of their own: a node of a scene, a group, or a label.
    label: number of a structure in a segmented scan (`scan/`).
    held: fixed in space; `--fix` and `--fix-mesh` say which region is (`fix_rule.py`).
    axes of a patient: RAS or LPS (`fix_mesh.py`); a label map is read in RAS.
    budget: memory and time that a preparation may take, known before its long part (`cost.py`).
"""
