"""Randomly damaged files: every reader either reads a file or refuses it with a message."""
