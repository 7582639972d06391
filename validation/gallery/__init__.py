"""The gallery: every check of `validation/` on one page, with its reference, our number, the error and a picture."""
