"""Models of mechanics that solvers solve: bodies, elements, contacts, nodes, and both joined."""
