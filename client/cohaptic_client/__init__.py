"""One user's side: a 1 kHz loop on its own, a link to the server, a device."""
