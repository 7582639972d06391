"""Files and processes: atomic writes, locks, checked HDF5 files, input files, threads, versions."""
