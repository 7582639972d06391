"""Plots of results and calibrations."""
