"""Magnets in the control loop: operating point, margins, lift, and drops of a rotor in one magnet."""

import math

import numpy as np
from cases import checks_of
from rigid_machine import disc_in

from rotordrop import build_drop_model, simulate_drop
from rotordrop.elements.magnet import Magnet
from rotordrop.physics import magnet_loop as loop
from rotordrop.physics.magnet import magnet_force
from rotordrop.rotor.reduction import Reduction
from rotordrop.simulate.case import DropCase, MagnetEvent, StateStart


def magnet_of(v):
    return Magnet(
        turns=v["turns"],
        pole_area=f"{v['pole_area']} m^2",
        gap=f"{v['gap']} m",
        bias=f"{v['bias']} A",
        angle=f"{v['angle_deg']} deg",
        resistance=f"{v['resistance']} ohm",
        voltage=f"{v['voltage']} V",
    )


def operating_point(v):
    magnet = magnet_of(v)
    by_current, by_way = magnet.slopes
    pull = magnet_force(magnet.force, v["gap"], v["x"], v["bias"], v["bias"])[0]
    return {
        "force by current k_i": by_current,
        "negative stiffness k_s": by_way,
        "inductance of a coil": magnet.inductance,
        "pull at half the gap, bias alone": abs(pull),
        "the same by k_s alone": abs(by_way * v["x"]),
    }


def proportional_of(v):
    by_current, by_way = magnet_of(v).slopes
    return float(v["proportional_over_ks_ki"] * by_way / by_current)


def pd_roots(v):
    by_current, by_way = magnet_of(v).slopes
    plant = (
        np.array([[0.0, 1.0], [by_way / v["mass"], 0.0]]),
        np.array([[0.0], [by_current / v["mass"]]]),
        np.array([[1.0, 0.0]]),
    )
    period = v["sample_time"]
    pd = loop.sampled_pid((proportional_of(v), 0.0, v["derivative"]), 1.0 / period, period, 0.0)
    pd = loop.SampledController(pd.step[1:, 1:], pd.input[1:], pd.output[1:], pd.direct, pd.unwind[1:])
    decay, frequency = loop.growth(loop.closed_loop(plant, [pd], period, 0.0), period)
    return {"decay": decay, "frequency": frequency}


def pid_margins(v):
    by_current, by_way = magnet_of(v).slopes
    gains, cutoff = (proportional_of(v), v["integral"], v["derivative"]), 2.0 * math.pi * v["filter"]

    def opened(w):
        response = gains[0] + gains[1] / (1j * w) + gains[2] * 1j * w / (1.0 + 1j * w / cutoff)
        lag = 1.0 + 1j * w / (2.0 * math.pi * v["bandwidth"])
        return by_current * response / lag / (-v["mass"] * w * w - by_way)

    found = loop.margins(opened, 1.0, 1e5)
    assert found is not None
    return {
        "crossover": found.crossover,
        "phase margin": math.degrees(found.phase),
        "delay margin": found.delay,
    }


def lift(v):
    found = loop.linear_lift(v["mass"], magnet_of(v).slopes, v["current"], v["mass"] * v["g"], v["depth"])
    return {
        "deepest place": found.deepest,
        "force to spare": found.spare,
        "time to the middle": found.time,
        "speed there": found.speed,
    }


def model_of(v, gap, gravity):
    """A disc in one magnet, above a touchdown bearing."""
    more = f"""
[[ambs]]
name = "A"
node = 2
stiffness = "1e6 N/m"
damping = "1e3 N s/m"
magnet = {{ turns = {v["turns"]}, pole_area = "{v["pole_area"]} m^2", gap = "{v["gap"]} m", \
bias = "{v["bias"]} A", angle = "{v["angle_deg"]} deg", resistance = "{v["resistance"]} ohm", \
voltage = "{v["voltage"]} V" }}
controller = {{ proportional = "15 kA/m" }}
[[touchdown_bearings]]
kind = "sleeve"
name = "A"
node = 2
air_gap = "{gap} m"
bore_radius = "35 mm"
friction = {{ static = 0.1, dynamic = 0.1 }}
support = {{ mass = "1e6 kg", stiffness = "1e14 N/m", damping = "0 N s/m" }}
"""
    machine = disc_in(more, v["mass"], gravity).machine
    return build_drop_model(machine, Reduction(modes=2, attachment=False), loops=True)


def dropped(v, action, gap, gravity, duration):
    """A drop from the middle whose coils carry the bias, after one action of the magnets."""
    model = model_of(v, gap, gravity)
    state = model.at_rest()
    state[model.layout.magnets] = v["bias"] if action != "off" else 0.0
    case = DropCase(
        speed=0.0,
        duration=duration,
        output_step=1e-5,
        tolerance=1e-9,
        start=StateStart(state=state),
        magnets=(MagnetEvent(action=action, time=0.0),),
    )
    return simulate_drop(model, case)


def fall_with_bias(v):
    def speed(action):
        drop = dropped(v, action, v["depth"], v["g"], 0.012)
        start = float(drop.contacts.start[0])
        before = drop.time < start
        height, time = drop.displacement[before, 0, 1], drop.time[before]
        return float((height[-2] - height[-1]) / (time[-1] - time[-2])) + float(
            # the last difference stands half a step and the rest before the touch
            (start - 0.5 * (time[-1] + time[-2])) * -np.diff(height, 2)[-1] / (time[-1] - time[-2]) ** 2
        )

    by_way, mass, depth = magnet_of(v).slopes[1], v["mass"], v["depth"]
    return {
        "speed at the touchdown bearing": speed("lost"),
        "the same freely": speed("off"),
        "the same by k_s alone": math.sqrt(by_way / mass * depth**2 + 2.0 * v["g"] * depth),
    }


def decay(v):
    drop = dropped(v, "bias decays", 2.75e-4, 0.0, v["time"])
    assert drop.magnets is not None
    current = float(drop.magnets.current[-1, 0, 0, 0])
    stored = 4.0 * 0.5 * magnet_of(v).inductance * v["bias"] ** 2
    return {
        "current after 10 ms": current,
        "its field energy over that of the bias": 1.0 - drop.certificate.energy_scale / stored,
        "imbalance of the energy": drop.certificate.energy_residual,
    }


CASES = {
    "MG01": operating_point,
    "MG02": pd_roots,
    "MG03": pid_margins,
    "MG04": lift,
    "MG05": fall_with_bias,
    "MG06": decay,
}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
