"""Analyses of a case: deployment, vibration, scissor array. All analyses have recording, restart, summary and plots in
common.
"""
