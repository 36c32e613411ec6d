"""Monitoring of a running server for its operators: metrics, health, and an overview."""
