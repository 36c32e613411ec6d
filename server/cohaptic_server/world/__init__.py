"""One tick of the shared object, as pure functions: find contacts, apply forces, build patches."""
