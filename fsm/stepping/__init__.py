"""Steps of time integrators. Models of arrays run them in compiled kernels, all other models in Python."""
