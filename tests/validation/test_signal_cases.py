"""Signal and statistics cases: the paper's waterfall grid, Hann correction, coast-down, axes, quartiles."""

import math

import numpy as np
from cases import checks_of

from rotordrop.elements.sensor import Sensor
from rotordrop.physics.aerodynamics import exponential_deceleration
from rotordrop.record.axes import planar_of, sensor_planes
from rotordrop.severity.statistics import stress_statistics
from rotordrop.spectrum.waterfall import frame_starts, waterfalls


def waterfall_grid(inputs):
    cut = {"points": inputs["nfft"], "overlap": inputs["overlap"]}
    frames = {f"frames for N={n}": float(len(frame_starts(n, **cut))) for n in inputs["points"]}
    # The count is that of frames really computed, not only of the formula.
    shortest = min(inputs["points"])
    (computed,) = waterfalls(np.zeros((shortest, 2)), inputs["fs"], highest_frequency=10.0, **cut)
    assert len(computed.time) == frames[f"frames for N={shortest}"]
    return frames | {"frequency resolution": computed.resolution}


def hann_amplitudes(inputs):
    points = 32768

    def highest(off):
        phase = 2.0 * math.pi * (1000.0 + off) * np.arange(points) / points
        tone = inputs["A"] * np.column_stack([np.cos(phase), np.zeros(points)])
        (found,) = waterfalls(tone, float(points), components=("x",), points=points)
        return float(found.amplitude.max())

    half = highest(0.5)
    return {
        "bin-centred amplitude": highest(0.0),
        "amplitude half-way between bins": half,
        "amplitude a quarter bin off": highest(0.25),
        "worst scalloping loss": 20.0 * math.log10(half / inputs["A"]),
    }


def exponential_coast_down(inputs):
    tau = inputs["dt"] / math.log(inputs["n0"] / inputs["n1"])
    omega = 2.0 * math.pi * inputs["n0"]
    return {
        "time constant": tau,
        "speed after 48 s": inputs["n0"] * math.exp(-48.0 / tau),
        "aerodynamic torque at t=0 for Ip=0.05": inputs["Ip"] * exponential_deceleration(0.0, omega, tau),
    }


def sensor_axes(inputs):
    angles = {"S1": "45 deg", "S2": "135 deg"}
    sensors = [Sensor.model_validate({"name": n, "node": 5, "angle": a}) for n, a in angles.items()]
    along = np.array([[inputs["s1"], inputs["s2"]]])
    (displacement,) = planar_of(along, sensor_planes(sensors))[0]
    return {"horizontal": float(displacement[0]), "vertical": float(displacement[1])}


def box_plot(inputs):
    hazen = stress_statistics(inputs["data"], rule="hazen")
    linear = stress_statistics(inputs["data"], rule="linear")
    return {
        "25 percentile Hazen/MATLAB": hazen.lower_quartile,
        "50 percentile Hazen/MATLAB": hazen.median,
        "75 percentile Hazen/MATLAB": hazen.upper_quartile,
        "25 percentile linear/numpy": linear.lower_quartile,
        "50 percentile linear/numpy": linear.median,
        "75 percentile linear/numpy": linear.upper_quartile,
        "mean": hazen.mean,
        "sd (n-1)": hazen.standard_deviation,
        "outliers > mean+3sd": float(hazen.above_three_sigma),
    }


CASES = {
    "S01": waterfall_grid,
    "S02": hann_amplitudes,
    "S03": exponential_coast_down,
    "S05": sensor_axes,
    "S06a": box_plot,
}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
