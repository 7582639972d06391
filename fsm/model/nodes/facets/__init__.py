"""Flexible facets: triangles, folds, creases of films, pressure."""
