"""What follows from the sections of a case: points and sides of contact, frames as bodies, outlines."""
