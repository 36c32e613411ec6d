"""Segmentations: label maps of NIfTI and NRRD files, and the smooth surfaces of their labels."""
