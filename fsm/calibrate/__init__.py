"""From test data to numbers that a case can use, with their intervals."""
