"""Frequency with which intervals of `fsm calibrate force` contain the true value."""
