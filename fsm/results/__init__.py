"""Results of a run: the `Solution`, its HDF5 file, and quantities computed from it."""
