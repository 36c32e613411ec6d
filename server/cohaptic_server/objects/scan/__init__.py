"""Segmentations: label maps in NIfTI and NRRD files, and smooth surfaces of their labels."""
