"""The gallery: every check of `validation/` on one page, with its reference, the computed value, the error and a figure."""
