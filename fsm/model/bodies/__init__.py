"""Rigid bodies: configuration, drives, loads, groups, and kernels of a compiled model of bodies."""
