"""Deformable bodies: how displacement answers the forces of contacts."""
