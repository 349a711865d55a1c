"""A rigid rotor that a thrust lands on a face, by EXUDYN: the numbers of the validation case E02.

    pip install exudyn==1.13.6
    python studies/exudyn/axial_landing.py

The rotor moves in three dimensions. A light sleeve slides along it and runs in the bore, a hollow sphere as
in `rigid_drop`, which motion along the axis would leave; sleeve and rotor are linked across the axis and in
their spin. The shoulder is a ring of points that land on a sphere of a kilometre, which the race carries, as
good as a plane. A hollow sphere stops the support. A constant force pushes the rotor aside and along its
axis. The script reads what it needs from the case and writes its numbers into it.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from rigid_drop import solve, write_expected

CASE = Path(__file__).resolve().parents[2] / "tests" / "validation" / "cases" / "E02.toml"

FAR = 1e3
"""Radius [m] of the sphere that stands for a plane: within 1e-10 m of it over the motion compared."""
SLEEVE = 0.02
"""Share of mass and inertia of the rotor that the sleeve has [1]. As it takes no part along the axis, thrust
and stiffness of the face are less by it, and the friction of the face is more: motion and forces across are
those of the whole mass."""
LINK, TURNING_LINK = 1e12, 1e9
"""Stiffness between both [N/m] and about the axis [N m/rad]: 4e-9 m under the largest force."""
COMPARED = (("x", "m", 1e-7), ("y", "m", 1e-7), ("z", "m", 5e-9), ("spin of the race", "rad/s", 0.02))
"""What is compared, its unit and its tolerance. Both codes are 2e-9 m apart after the first touch of the
bore, and later contacts carry that to 7e-8 m."""
POINT = 1e-6
"""Radius [m] of a point of the shoulder."""
POINTS = 8
"""Points of the shoulder."""


def memory(system: Any, gap: float) -> int:
    """Node that a contact remembers its gap [m] in."""
    start = [gap, 0.0, 0.0, 0.0]
    return int(system.AddNode(eii.NodeGenericData(initialCoordinates=start, numberOfDataCoordinates=4)))


def land(inputs: dict[str, Any], step: float) -> np.ndarray:
    """Displacement of the rotor [m], x, y and z, and spin of the race [rad/s]; shape (T, 4)."""
    system = exu.SystemContainer().AddSystem()
    b, face = inputs["bearing"], inputs["face"]
    node = system.AddNode(
        eii.NodeRigidBodyRotVecLG(
            referenceCoordinates=[0.0] * 6,
            initialVelocities=[*inputs["velocity"], 0.0, 0.0, 0.0, inputs["speed"]],
        )
    )
    mass, polar = inputs["mass"], inputs["polar_inertia"]
    inertia = [inputs["diametral_inertia"]] * 2 + [(1.0 - SLEEVE) * polar, 0.0, 0.0, 0.0]
    rotor = system.AddObject(
        eii.ObjectRigidBody(mass=(1.0 - SLEEVE) * mass, inertia=inertia, nodeNumber=node)
    )
    centre = system.AddMarker(eii.MarkerBodyRigid(bodyNumber=rotor, localPosition=[0.0] * 3))
    aside, up, along = (inputs["force"][axis] for axis in ("x", "y", "along"))
    force = [aside, up - mass * inputs["gravity"], (1.0 - SLEEVE) * along]
    system.AddLoad(eii.LoadForceVector(markerNumber=centre, loadVector=force))
    sleeve_node = system.AddNode(
        eii.NodeRigidBody2D(
            referenceCoordinates=[0.0] * 3, initialVelocities=[*inputs["velocity"], inputs["speed"]]
        )
    )
    sleeve = system.AddObject(
        eii.ObjectRigidBody2D(mass=SLEEVE * mass, inertia=SLEEVE * polar, nodeNumber=sleeve_node)
    )
    on_sleeve = system.AddMarker(eii.MarkerBodyRigid(bodyNumber=sleeve, localPosition=[0.0] * 3))
    stiffness = np.diag([LINK, LINK, 0.0, 0.0, 0.0, TURNING_LINK])
    system.AddObject(
        eii.ObjectConnectorRigidBodySpringDamper(
            markerNumbers=[centre, on_sleeve],
            stiffness=stiffness,
            damping=np.sqrt(stiffness * np.diag([SLEEVE * mass] * 3 + [SLEEVE * polar] * 3)),
        )
    )
    ground = system.AddObject(eii.ObjectGround())
    still = system.AddMarker(eii.MarkerBodyRigid(bodyNumber=ground, localPosition=[0.0] * 3))
    ring_node = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[0.0] * 3))
    ring = system.AddObject(
        eii.ObjectRigidBody2D(mass=b["ring_mass"], inertia=b["race_inertia"], nodeNumber=ring_node)
    )

    def on_ring(place: list[float]) -> int:
        return int(system.AddMarker(eii.MarkerBodyRigid(bodyNumber=ring, localPosition=place)))

    k, c = b["support_stiffness"], b["support_damping"]
    on_axis = on_ring([0.0] * 3)
    system.AddObject(
        eii.ObjectConnectorCartesianSpringDamper(
            markerNumbers=[still, on_axis], stiffness=[k, k, 0.0], damping=[c, c, 0.0]
        )
    )
    system.AddObject(
        eii.ObjectContactSphereSphere(
            markerNumbers=[on_sleeve, on_axis],
            nodeNumber=memory(system, b["air_gap"]),
            spheresRadii=[b["bore_radius"] - b["air_gap"], b["bore_radius"]],
            isHollowSphere1=True,
            dynamicFriction=b["friction"],
            contactStiffness=b["contact_stiffness"],
            contactStiffnessExponent=b["contact_exponent"],
        )
    )
    # stop of the support
    system.AddObject(
        eii.ObjectContactSphereSphere(
            markerNumbers=[on_axis, still],
            nodeNumber=memory(system, b["stop_gap"]),
            spheresRadii=[b["bore_radius"], b["bore_radius"] + b["stop_gap"]],
            isHollowSphere1=True,
            contactStiffness=b["stop_stiffness"],
        )
    )
    arm = face["arm"]
    height = math.sqrt((FAR + POINT + face["gap"]) ** 2 - arm * arm)
    plane = on_ring([0.0, 0.0, height])
    for i in range(POINTS):
        angle = 2.0 * math.pi * i / POINTS
        place = [arm * math.cos(angle), arm * math.sin(angle), 0.0]
        point = system.AddMarker(eii.MarkerBodyRigid(bodyNumber=rotor, localPosition=place))
        system.AddObject(
            eii.ObjectContactSphereSphere(
                markerNumbers=[point, plane],
                nodeNumber=memory(system, face["gap"]),
                spheresRadii=[POINT, FAR],
                dynamicFriction=face["friction"] / (1.0 - SLEEVE),
                contactStiffness=(1.0 - SLEEVE) * face["stiffness"] / POINTS,
            )
        )
    moved, turned = (
        system.AddSensor(
            eii.SensorBody(
                bodyNumber=body, localPosition=[0.0] * 3, storeInternal=True, outputVariableType=kind
            )
        )
        for body, kind in (
            (rotor, exu.OutputVariableType.Displacement),
            (ring, exu.OutputVariableType.AngularVelocity),
        )
    )
    solve(system, inputs, step)
    return np.column_stack(
        [system.GetSensorStoredData(moved)[:, 1:4], system.GetSensorStoredData(turned)[:, 3]]
    )


def main() -> None:
    """Simulate with two steps, say how far apart they are, and write the numbers of the case."""
    inputs = tomllib.loads(CASE.read_text(encoding="utf-8"))["inputs"]
    coarse, fine = (land(inputs, step) for step in (1e-7, 5e-8))
    print(
        "largest difference between both steps [m], [rad/s]:", np.abs(coarse - fine).max(axis=0), fine.shape
    )
    every = round(inputs["compared_step"] / inputs["output_step"])
    rows = [
        (f"{name}, {1e3 * i * inputs['compared_step']:g} ms", round(value, 12), unit, tolerance)
        for i, row in enumerate(fine[::every].tolist())
        if i > 0
        for value, (name, unit, tolerance) in zip(row, COMPARED, strict=True)
    ]
    write_expected(CASE, rows)
    print("largest displacement [m]:", np.abs(fine).max(axis=0))


if __name__ == "__main__":
    main()
