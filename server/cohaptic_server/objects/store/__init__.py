"""A bounded cache on disk for prepared objects: arrays that are mapped into memory."""
