"""Reasons why the steps of a case are computed in Python and not in one compiled kernel, and what this costs.

The reasons follow from the scene, so `fsm check` knows them without a compiled system. The system of a run has the reasons
of its own step; no other place decides.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import NamedTuple

from fsm.case.models.scene import ForceElement, Scene
from fsm.registry import CONTACT_LAWS, FRICTION_LAWS
from fsm.text.shown_units import count

_MARCHING = ("generalized-alpha", "newmark", "mean-force", "explicit")
"""Methods for motions whose steps a kernel can compute."""
_OVERHEAD = 1000.0
"""Time of Python in one iteration over the time of the kernels for one unknown. A step of a strip in motion with 120
unknowns takes 301 us in Python and 32 us compiled."""


class InPython(NamedTuple):
    """Reasons for steps in Python, in motions and in statics; empty for compiled steps."""

    motion: tuple[str, ...] = ()

    def of(self, method: str) -> tuple[str, ...]:
        """Reasons of a step with a method."""
        if method == "static":
            return self.motion
        if method == "arc-length":
            return ('the method "arc-length" has no compiled form',)
        return self.motion if method in _MARCHING else (f'the method "{method}" has no compiled form',)


COMPILED = InPython()
"""No part in Python."""


def parts_in_python(
    scene: Scene, step: str | None = None, contact: bool = True
) -> InPython:
    """Parts of a scene that have no compiled form; each reason names its part.

    Parameters
    ----------
    scene : Scene
    step : name of the step, for elements that act in some steps only; absent: all elements
    contact : whether contact acts
    """
    touching = contact and scene.contact is not None and bool(scene.pairs)
    elements = [e for e in scene.elements if step is None or e.steps is None or step in e.steps]
    found = [(reason, element.name) for element in elements for reason in _of_element(element)]
    found += [(f"the kind {e.kind!r} of an extension has no compiled form", e.name) for e in scene.point_elements]
    motion = [f"element {_named(reason, found)}: {reason}" for reason in dict.fromkeys(reason for reason, _ in found)]
    motion += _of_contact(scene) if touching else ()
    return InPython((*motion, *of_compiler().motion))


def of_compiler() -> InPython:
    """Reasons for parts that all have a compiled form."""
    off = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
    return InPython(("the compiler is off (NUMBA_DISABLE_JIT)",) if off else ())


def cost_in_python(unknowns: int) -> float:
    """Estimated ratio of the time of a step in Python to that of a compiled step."""
    return 1.0 + _OVERHEAD / max(unknowns, 1)


def _named(reason: str, found: list[tuple[str, str]]) -> str:
    """Name of the first element with a reason, and the number of others."""
    names = [name for one, name in found if one == reason]
    return repr(names[0]) + (f" and {count(len(names) - 1, 'other')}" if len(names) > 1 else "")


def _of_element(element: ForceElement) -> Iterator[str]:
    if element.law is not None:
        yield f"the law {element.law!r} of an extension has no compiled form"


def _of_contact(scene: Scene) -> Iterator[str]:
    contact, friction = scene.contact, scene.friction
    if contact is not None and contact.law in CONTACT_LAWS:
        yield f"contact: the law {contact.law!r} of an extension has no compiled form"
    if friction is not None and friction.law in FRICTION_LAWS:
        yield f"friction: the law {friction.law!r} of an extension has no compiled form"
