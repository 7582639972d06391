"""Parts of case files for scenes of a few bodies joined by springs."""

from __future__ import annotations


def bodies(**mass: float) -> str:
    """Bodies by name and mass, kg, with moments of inertia of 0.1 kg m^2."""
    return "".join(
        f'[[scene.bodies]]\nname = "{name}"\nmass = {value}\ninertia = [0.1, 0.1, 0.1]\n' for name, value in mass.items()
    )


def spring(name: str, inner: str, outer: str, stiffness: float) -> str:
    """Spring with the same stiffness in all directions, N/m, and 1 N m/rad about all axes."""
    return (
        f'[[scene.elements]]\nname = "{name}"\ninner = "{inner}"\nouter = "{outer}"\n'
        f"translation = [{stiffness}, {stiffness}, {stiffness}]\nrotation = [1.0, 1.0, 1.0]\n"
    )


ROPE = spring("rope", "hand", "block", 600.0)
"""Spring between the bodies of `BLOCK_AND_HAND`."""
BLOCK_AND_HAND = bodies(block=2.0, hand=1.0)
