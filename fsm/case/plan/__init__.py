"""Course of a case: order of its drives and loads, start, method, number of records."""
