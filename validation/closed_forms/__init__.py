"""Cases with an exact or converged answer, each computed through the public parts of the program."""
