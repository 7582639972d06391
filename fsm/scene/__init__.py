"""Descriptions: frozen models of a scene and a case, SI inside, no numerics."""
