"""The machine of the paper with magnets and controllers that hold it."""

from rotordrop.machine import example_machine

MAGNET = {
    "turns": 200,
    "pole_area": "6 cm^2",
    "gap": "0.55 mm",
    "bias": "4 A",
    "resistance": "0.5 ohm",
    "voltage": "150 V",
    "bandwidth": "2 kHz",
}
CONTROLLER = {
    "proportional": "14.6 kA/m",
    "integral": "300 kA/(m s)",
    "derivative": "30 A s/m",
    "filter": "5 kHz",
    "sample_time": "50 us",
    "delay": "50 us",
}


def looped_machine(magnet=None, controller=None):
    """The machine, with other entries of magnets and controllers."""
    paper = example_machine("paper")
    tables = {"magnet": MAGNET | (magnet or {}), "controller": CONTROLLER | (controller or {})}
    return paper.changed(ambs=tuple(amb.changed(**tables) for amb in paper.ambs))
