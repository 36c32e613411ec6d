"""The paper's figures, again: one module for each, and the rig that they share."""
