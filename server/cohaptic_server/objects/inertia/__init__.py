"""Natural modes of an object with a density; the store keeps them."""
