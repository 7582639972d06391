"""Report of results as one HTML page that works from disk, without network and without other files."""
