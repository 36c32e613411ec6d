"""Parts of an object with materials of their own: nodes of a scene or groups of a volume mesh."""
