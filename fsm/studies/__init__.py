"""Studies of a case: which parameter matters, how sure a result is, and which values are best."""
