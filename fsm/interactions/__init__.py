"""Kinematic measures of elements and contacts, and the assembly of their forces and tangents."""
