"""Run of a case, and of a table of cases: recorder, checkpoints, summary, kernels compiled in advance."""
