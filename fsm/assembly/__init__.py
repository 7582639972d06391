"""Rigid bodies and ANCF elements in one system: frames on elements, and one matrix pattern for all nodes."""
