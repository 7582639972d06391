"""What people see of a run: figures, reports, pictures of the start, files for other programs."""
