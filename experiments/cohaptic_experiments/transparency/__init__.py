"""What one hand feels of another: over frequency, and after a press."""
