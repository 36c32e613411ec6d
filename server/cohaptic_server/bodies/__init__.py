"""Elastic bodies, one per file, behind the Protocol in `body.py`. No I/O."""
