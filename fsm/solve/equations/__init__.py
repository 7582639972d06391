"""Equations of a step: linear solvers, Newton's method, equilibria."""
