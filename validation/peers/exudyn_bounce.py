"""The bouncing stack of balls in Exudyn: rigid bodies and sphere-sphere contacts."""

from __future__ import annotations

import exudyn as exu
from exudyn import itemInterface as item

from validation.peers.bounce import GROUND_RADIUS, INERTIA, MASS, RADIUS, STIFFNESS, heights
from validation.peers.exudyn_rigid import Made
from validation.peers.rigid import GRAVITY

__all__ = ["bounce"]

_POSITION = exu.OutputVariableType.Position


def bounce() -> Made:
    """System, sensor of the highest ball, and its height."""
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(item.ObjectGround())
    below = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=ground, localPosition=[0.0, 0.0, -GROUND_RADIUS]))
    radius, sensor = GROUND_RADIUS, -1
    for z in heights():
        node = mbs.AddNode(
            item.NodeRigidBodyRxyz(referenceCoordinates=[0.0, 0.0, float(z), 0.0, 0.0, 0.0])
        )
        body = mbs.AddObject(
            item.ObjectRigidBody(physicsMass=MASS, physicsInertia=[INERTIA] * 3 + [0.0] * 3, nodeNumber=node)
        )
        mass = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=body))
        mbs.AddLoad(item.LoadMassProportional(markerNumber=mass, loadVector=[0.0, 0.0, -GRAVITY]))
        centre = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localPosition=[0.0, 0.0, 0.0]))
        state = mbs.AddNode(item.NodeGenericData(initialCoordinates=[0.1, 0.0, 0.0, 0.0], numberOfDataCoordinates=4))
        mbs.AddObject(
            item.ObjectContactSphereSphere(
                markerNumbers=[below, centre], nodeNumber=state, spheresRadii=[radius, RADIUS],
                contactStiffness=STIFFNESS, contactStiffnessExponent=1.5, contactDamping=0.0, dynamicFriction=0.0,
            )
        )  # fmt: skip
        sensor = mbs.AddSensor(item.SensorBody(bodyNumber=body, storeInternal=True, outputVariableType=_POSITION))
        below, radius = centre, RADIUS
    mbs.Assemble()
    return mbs, sensor, lambda x: x[:, 2:3]
