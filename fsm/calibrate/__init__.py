"""From test data to stiffness, and from stiffness to a prediction with a band."""
