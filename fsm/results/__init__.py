"""Results: one `Solution`, one HDF5 layout; everything else reads it."""
