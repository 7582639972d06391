"""Times of runs and of kernels."""
