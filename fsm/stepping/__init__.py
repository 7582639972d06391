"""Steps of time integrators. Models of arrays run the steps in compiled kernels, all other models in Python."""
