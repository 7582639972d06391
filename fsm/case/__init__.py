"""Description of a case: frozen models in SI units, their checks, and the reading of case files; no numerics."""
