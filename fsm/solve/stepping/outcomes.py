"""Outcomes of one step of a method for motions."""

STEPPED, STEP_TOO_SMALL, NO_SOLUTION, OBJECTED, UNABLE = 0, 1, 2, 3, 4
"""OBJECTED: the model rejects every step size. UNABLE: the model cannot solve its linear equations. The state then equals
the state before the step, and another model of the same system should repeat the step."""
