"""Calibration: parameters with intervals from test data, and predictions with uncertainty bands."""
