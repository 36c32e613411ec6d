"""Places any device's workspace in the world, with scale, rotation, clutch and centring."""
