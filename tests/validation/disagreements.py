"""Published numbers that do not agree with ours: what is printed, what we get, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cases import load_case
from test_rotor_cases import CASES as ROTOR_CASES

from rotordrop.machine import example_machine
from rotordrop.physics.hertz import contact_parameters
from rotordrop.rotor.critical_speeds import critical_speed_map
from rotordrop.rotor.statics import bearing_load_shares


@dataclass(frozen=True, kw_only=True)
class Disagreement:
    """A printed number that the library does not reproduce."""

    what: str
    source: str
    printed: float
    compute: Callable[[], float]
    unit: str
    reason: str

    def deviation(self) -> float:
        """Relative deviation of our number from the printed one."""
        return self.compute() / self.printed - 1.0


def nde_load() -> float:
    return float(bearing_load_shares(example_machine("paper"))[0])


def second_mode_with_support_mass() -> float:
    return float(critical_speed_map(example_machine("paper"), [1e8]).at_lines["with support mass"][1])


def delta_star() -> float:
    return float(contact_parameters(0.4795)[2])


def third_mode_of_the_deep_beam() -> float:
    case = load_case("R12")
    return float(ROTOR_CASES["R12"](case.inputs)["bending mode 3 (double)"])


DISAGREEMENTS = (
    Disagreement(
        what="static load of the NDE bearing",
        source="Neisi 2020, text",
        printed=177.0,
        compute=nde_load,
        unit="N",
        reason="does not fit the paper's own mass share of 17.8 kg, which weighs 174.6 N",
    ),
    Disagreement(
        what="second mode of the settled rotor",
        source="Neisi 2020, Fig. 19",
        printed=235.0,
        compute=second_mode_with_support_mass,
        unit="Hz",
        reason=(
            "the paper's map has supports without mass, its own support model has 40 kg: on 1e8 N/m that is "
            "a resonance at 252 Hz, which splits the mode; without mass our map gives 235 Hz on the same "
            "machine (a reconstruction fitted to the paper, so that agreement proves nothing)"
        ),
    ),
    Disagreement(
        what="third mode of the deep simply supported beam",
        source="Altair OS-V:0415 for NAFEMS FV5",
        printed=284.55,
        compute=third_mode_of_the_deep_beam,
        unit="Hz",
        reason="the closed form printed by NAFEMS is 283.47 Hz; Altair used finite elements",
    ),
    Disagreement(
        what="δ* at a curvature difference of 0.4795",
        source="table of contact parameters in Harris, Rolling Bearing Analysis",
        printed=0.9429,
        compute=delta_star,
        unit="1",
        reason="a misprint: the exact elliptic integrals give 0.9432 and the neighbouring entries agree",
    ),
)
