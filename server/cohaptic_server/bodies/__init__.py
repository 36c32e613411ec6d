"""Deformable bodies: the displacement under the forces of contacts."""
