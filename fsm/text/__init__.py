"""Texts for people: quantities with their units, labelled lines, short forms of objects, names of loads."""
