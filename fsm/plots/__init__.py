"""Plots of a solution, fit for a paper."""
