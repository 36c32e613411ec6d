"""From a density to an object that swings: its natural modes, kept in the store."""
