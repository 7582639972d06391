"""Finite segments: compilation of a scene into arrays, and the System made of them."""
