"""Steps of time integrators, written once: kernels compile them for models of arrays, Python runs them for all others."""
