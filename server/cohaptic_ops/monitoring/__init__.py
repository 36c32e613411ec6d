"""Monitoring of a running server for its operators: metrics, health, and a page of its state."""
