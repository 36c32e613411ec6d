"""Parts of an object with materials of their own: nodes of a scene, groups of a volume mesh."""
