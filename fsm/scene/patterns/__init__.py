"""Crease patterns of folded sheets: vertices, edges with assignment and fold angle, and faces."""
