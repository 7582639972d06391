"""Analyses of a case: deployment, vibration, scissor array. All share recording, restart, summary and plots."""
