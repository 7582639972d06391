"""Rigid bodies and ANCF elements in one system: frames, gas, pressure, one matrix pattern."""
