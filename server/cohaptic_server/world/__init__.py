"""One tick of the shared object as pure functions: contacts found, forces applied, patches built."""
