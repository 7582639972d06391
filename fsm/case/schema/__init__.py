"""Keys of cases: units, places, faults, and the facts that the fields of models state."""
