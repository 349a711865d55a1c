"""A rigid rotor dropped into two unlike bearings, by EXUDYN: the numbers of the validation case E01.

    pip install exudyn==1.13.6
    python studies/exudyn/rigid_drop.py

EXUDYN (https://exudyn.readthedocs.io) is a multibody code whose authors did not know of this program. It
moves the rotor in three dimensions with finite rotations; each bearing is a hollow sphere on a planar body
that may shift and spin, held by springs and dampers. The script reads what it needs from the case and writes
its numbers into it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

CASE = Path(__file__).resolve().parents[2] / "tests" / "validation" / "cases" / "E01.toml"

TOLERANCE = 1e-7
"""Of the compared displacements [m]. After the first contact both codes are 2e-9 m apart, as finite rotations
by 1e-3 rad make them, and 13 more contacts carry that to 5e-8 m."""


def drop(inputs: dict[str, Any], step: float) -> np.ndarray:
    """Displacement [m] of the rotor at both bearings at the asked instants, shape (T, 2, 2)."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    mass, polar, diametral = inputs["mass"], inputs["polar_inertia"], inputs["diametral_inertia"]
    bearings = inputs["bearings"]
    start = inputs["start"]
    positions = [bearing["position"] for bearing in bearings]
    tilt = [
        (start["velocity"][1][axis] - start["velocity"][0][axis]) / (positions[1] - positions[0])
        for axis in (0, 1)
    ]
    shift = [start["velocity"][0][axis] - tilt[axis] * positions[0] for axis in (0, 1)]
    node = system.AddNode(
        eii.NodeRigidBodyRotVecLG(
            referenceCoordinates=[0.0] * 6,
            initialVelocities=[*shift, 0.0, -tilt[1], tilt[0], inputs["speed"]],
        )
    )
    rotor = system.AddObject(
        eii.ObjectRigidBody(mass=mass, inertia=[diametral, diametral, polar, 0.0, 0.0, 0.0], nodeNumber=node)
    )
    middle = system.AddMarker(eii.MarkerBodyMass(bodyNumber=rotor))
    system.AddLoad(eii.LoadMassProportional(markerNumber=middle, loadVector=[0.0, -inputs["gravity"], 0.0]))
    ground = system.AddObject(eii.ObjectGround())
    sensors = []
    for bearing in bearings:
        place = [0.0, 0.0, bearing["position"]]
        on_rotor = system.AddMarker(eii.MarkerBodyRigid(bodyNumber=rotor, localPosition=place))
        ring_node = system.AddNode(eii.NodeRigidBody2D(referenceCoordinates=[0.0, 0.0, 0.0]))
        ring = system.AddObject(
            eii.ObjectRigidBody2D(
                mass=bearing["ring_mass"], inertia=bearing["race_inertia"], nodeNumber=ring_node
            )
        )
        on_ring = system.AddMarker(eii.MarkerBodyRigid(bodyNumber=ring, localPosition=place))
        on_ground = system.AddMarker(eii.MarkerBodyPosition(bodyNumber=ground, localPosition=place))
        k, c = bearing["support_stiffness"], bearing["support_damping"]
        system.AddObject(
            eii.ObjectConnectorCartesianSpringDamper(
                markerNumbers=[on_ground, on_ring], stiffness=[k, k, 0.0], damping=[c, c, 0.0]
            )
        )
        memory = system.AddNode(
            eii.NodeGenericData(
                initialCoordinates=[bearing["air_gap"], 0.0, 0.0, 0.0], numberOfDataCoordinates=4
            )
        )
        system.AddObject(
            eii.ObjectContactSphereSphere(
                markerNumbers=[on_rotor, on_ring],
                nodeNumber=memory,
                spheresRadii=[bearing["bore_radius"] - bearing["air_gap"], bearing["bore_radius"]],
                isHollowSphere1=True,
                dynamicFriction=bearing["friction"],
                frictionProportionalZone=1e-3,
                contactStiffness=bearing["contact_stiffness"],
                contactStiffnessExponent=bearing["contact_exponent"],
            )
        )
        sensors.append(
            system.AddSensor(
                eii.SensorBody(
                    bodyNumber=rotor,
                    localPosition=place,
                    storeInternal=True,
                    outputVariableType=exu.OutputVariableType.Displacement,
                )
            )
        )
    solve(system, inputs, step)
    return np.stack([system.GetSensorStoredData(sensor)[:, 1:3] for sensor in sensors], axis=1)


def solve(system: Any, inputs: dict[str, Any], step: float) -> None:
    """Integrate a system with a constant step [s]."""
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(inputs["duration"] / step)
    settings.timeIntegration.endTime = inputs["duration"]
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = inputs["output_step"]
    settings.timeIntegration.adaptiveStep = False
    settings.timeIntegration.discontinuous.iterationTolerance = 1e9  # an explicit step needs no repetition
    settings.timeIntegration.verboseMode = 0
    system.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)


def write_expected(file: Path, rows: Iterable[tuple[str, float, str, float]]) -> None:
    """Write name, value, unit and absolute tolerance of each number into the file of a case."""
    given, head, _ = file.read_text(encoding="utf-8").partition("[expected]\n")
    lines = (f'"{n}" = {{ value = {v}, unit = "{unit}", tol_abs = {tol} }}\n' for n, v, unit, tol in rows)
    file.write_text(given + head + "".join(lines), encoding="utf-8")


def main() -> None:
    """Simulate with two steps, say how far apart they are, and write the numbers of the case."""
    inputs = tomllib.loads(CASE.read_text(encoding="utf-8"))["inputs"]
    bearings = inputs["bearings"]
    coarse, fine = (drop(inputs, step) for step in (1e-7, 5e-8))
    print("largest difference between both steps [m]:", np.abs(coarse - fine).max(), fine.shape)
    every = round(inputs["compared_step"] / inputs["output_step"])
    rows = [
        (f"{axis} at {bearing['name']}, {1e3 * i * inputs['compared_step']:.0f} ms", value, "m", TOLERANCE)
        for i, at_instant in enumerate(np.round(fine[::every], 12).tolist())
        if i > 0
        for bearing, at_bearing in zip(bearings, at_instant, strict=True)
        for axis, value in zip("xy", at_bearing, strict=True)
    ]
    write_expected(CASE, rows)
    print("largest displacement [m]:", np.hypot(*np.moveaxis(fine, -1, 0)).max())


if __name__ == "__main__":
    main()
