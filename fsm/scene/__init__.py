"""Models of a case and a scene; they are frozen, have values in SI units, and do no numerics."""
