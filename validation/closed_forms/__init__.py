"""Cases with an exact or converged solution, each computed through the public interface of the program."""
