"""The paper's figures, reproduced: one module for each, and their common rig."""
