"""Steps of time integrators. Compiled models run the steps in compiled kernels, all other models in Python."""
