"""A cache of limited size on disk for prepared objects: arrays that are mapped into memory."""
