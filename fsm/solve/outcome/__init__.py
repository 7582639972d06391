"""Outcome of a solve: states, energies, status, points at which a run can restart."""
