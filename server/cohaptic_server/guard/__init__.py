"""Rate limits and other budgets of the server for a connection and for an address. No I/O."""
