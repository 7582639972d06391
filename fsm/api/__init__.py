"""Python interface: cases, results and models as objects (docs/python.md)."""
