"""Where in the world a device's workspace lies: scale, rotation, clutch and centring, for all."""
