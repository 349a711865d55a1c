"""Soft mounts by their kernels: a ribbon through a cycle, branches over frequency, a mass on a stop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from cases import Compute, checks_of
from scipy.integrate import solve_ivp

from rotordrop.arrays import Array
from rotordrop.elements.mount import Mount
from rotordrop.physics import columns as L
from rotordrop.physics import mount

pytestmark = pytest.mark.acceptance
Inputs = Mapping[str, Any]


def numbers_of(**elements: Any) -> Array:
    """The numbers of a mount of described elements, given in SI units."""
    row = np.zeros(L.N_BEARING_COLUMNS)
    Mount.model_validate(elements).fill(row)
    return row[L.MOUNT : L.MOUNT_END]


def cycle(inputs: Inputs) -> dict[str, float]:
    """The second cycle of a harmonic deflection along a slant: loss, and what is in phase with it."""
    ribbon = {
        "friction_stiffness": f"{inputs['k_d']!r} N/m",
        "slip_force": f"{inputs['slip_force']!r} N",
        "sharpness": inputs["sharpness"],
    }
    numbers, X = numbers_of(ribbon=ribbon), inputs["amplitude"]
    along = np.array([0.6, 0.8])

    def motion(t: float, e: Array) -> Array:
        rate, v = np.zeros(2), X * np.cos(t) * along
        x = X * np.sin(t) * along
        mount.mount_force(numbers, x[0], x[1], v[0], v[1], e, rate)
        return rate

    end = 4.0 * np.pi
    t = np.linspace(0.5 * end, end, 20001)
    path = solve_ivp(motion, (0.0, end), np.zeros(2), t_eval=t, rtol=1e-8, atol=1e-13, max_step=2e-3).y
    force = inputs["k_1"] * X * np.sin(t) + inputs["k_d"] * along @ path
    return {
        "loss of a cycle": float(np.trapezoid(force * X * np.cos(t), t)),
        "harmonic stiffness": float(np.trapezoid(force * np.sin(t), t) / (np.pi * X)),
    }


def branches(inputs: Inputs) -> dict[str, float]:
    """The answer of the states to a harmonic deflection, from their rates as the filter sees them."""
    elements = [
        {"stiffness": f"{k!r} N/m", "time": f"{tau!r} s"}
        for k, tau in zip(inputs["stiffness"], inputs["time"], strict=True)
    ]
    numbers = numbers_of(maxwell=elements)

    def dynamic(frequency: float) -> complex:
        total, omega = complex(inputs["k_0"]), 2.0 * np.pi * frequency
        for state in range(0, 2 * len(elements), 2):
            by_stretch, by_rate = mount.stretch_gradient(numbers, state, 0.0, 0.0, 0.0, 0.0)
            stretch = by_rate[0] * 1j * omega / (1j * omega - by_stretch[0])
            total += mount.stiffness_of_state(numbers, state) * stretch
        return total

    middle = dynamic(100.0)
    return {
        "stiffness at 5 Hz": dynamic(5.0).real,
        "stiffness at 1 kHz": dynamic(1000.0).real,
        "loss factor at 100 Hz": middle.imag / middle.real,
    }


def caught(inputs: Inputs, stop: bool) -> float:
    """Peak force under a mass that falls onto the mount, by integration."""
    numbers = numbers_of(
        **(
            {
                "stop": {
                    "gap": f"{inputs['stop_gap']!r} m",
                    "stiffness": f"{inputs['stop_stiffness']!r} N/m",
                    "damping": "0 s/m",
                }
            }
            if stop
            else {}
        )
    )
    none = np.zeros(0)

    def held(y: float, v: float) -> float:
        return inputs["k"] * y + mount.mount_force(numbers, 0.0, y, 0.0, v, none, none)[1]

    def motion(_t: float, state: Array) -> list[float]:
        return [state[1], inputs["g"] - held(*state) / inputs["m"]]

    start = [0.0, np.sqrt(2.0 * inputs["g"] * inputs["height"])]
    path = solve_ivp(motion, (0.0, 0.03), start, method="DOP853", rtol=1e-10, atol=1e-14, max_step=1e-5).y
    return max(held(y, v) for y, v in path.T)


def stopped(inputs: Inputs) -> dict[str, float]:
    return {
        "peak force without a stop": caught(inputs, stop=False),
        "peak force with the stop": caught(inputs, stop=True),
    }


CASES: dict[str, Compute] = {"MT01": cycle, "MT02": branches, "MT03": stopped}


test_case, test_a_changed_input_is_noticed = checks_of(
    CASES,
    [
        ("MT01", {"slip_force": 1530.0}),
        ("MT01", {"sharpness": 10.0}),
        ("MT02", {"k_0": 5.01e6}),
        ("MT02", {"time": [0.03, 0.003, 0.00031]}),
        ("MT03", {"stop_gap": 2.51e-4}),
        ("MT03", {"stop_stiffness": 5.1e8}),
    ],
)
