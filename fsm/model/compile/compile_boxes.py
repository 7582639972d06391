"""Compile contact of boxes with boxes."""

from __future__ import annotations

import numpy as np

from fsm.case.models.scene import GROUND
from fsm.errors import CaseError, Fault
from fsm.kernels.rotation import rotation_matrix
from fsm.model.contact.boxes import Box, box_contacts
from fsm.model.contact.pair_contacts import PairContacts
from fsm.model.contact.touching import Touching


def compile_boxes(touching: Touching) -> tuple[PairContacts, ...]:
    """Compile the geometry of pairs of two obstacles that are boxes, without pairs of which no body can move."""
    contact = touching.scene.contact
    assert contact is not None
    index = {body.name: number for number, body in enumerate(touching.bodies)}
    known = {obstacle.name: obstacle for obstacle in touching.scene.obstacles}
    pairs, boxes = [], []
    for number, pair in touching.pairs:
        both = known[pair.first], known[pair.second]
        bodies = [obstacle.body or GROUND for obstacle in both]
        if all(touching.bodies[index[name]].held for name in bodies):
            continue
        pairs.append((number, pair.model_copy(update={"first": bodies[0], "second": bodies[1]})))
        one, two = (
            Box(
                index[name], 0.5 * np.array(obstacle.size), np.array(obstacle.position),
                rotation_matrix(np.array(obstacle.orientation)),
            )
            for name, obstacle in zip(bodies, both, strict=True)
        )  # fmt: skip
        boxes.append((one, two))
    if not pairs:
        return ()
    if contact.restitution is not None:
        text = "the depth of boxes is a mean over cells, whose speed is zero at first touch, and `restitution` refers to it"
        raise CaseError([Fault("contact.restitution", f'{text}; give law = "hertz" or "linear" with `damping`')])
    return (box_contacts(touching._replace(pairs=tuple(pairs)), boxes, contact.points_per_segment),)
