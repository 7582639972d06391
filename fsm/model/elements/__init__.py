"""Force elements between two bodies, one file a kind: creases, springs, ligaments, laws of extensions."""
