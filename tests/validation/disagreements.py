"""Published numbers that do not agree with ours: what is printed, what we get, and why."""

from collections.abc import Callable
from dataclasses import dataclass

from cases import load_case
from test_rotor_cases import CASES as ROTOR_CASES

from rotordrop import critical_speed_map, example_machine
from rotordrop.physics.hertz import contact_parameters
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

    def deviation(self):
        """Relative deviation of our number from the printed one."""
        return float(self.compute()) / self.printed - 1.0


DISAGREEMENTS = (
    Disagreement(
        what="static load of the NDE bearing",
        source="Neisi 2020, text",
        printed=177.0,
        compute=lambda: bearing_load_shares(example_machine("paper"))[0],
        unit="N",
        reason="does not fit the paper's own mass share of 17.8 kg, which weighs 174.6 N",
    ),
    Disagreement(
        what="second mode of the settled rotor",
        source="Neisi 2020, Fig. 19",
        printed=235.0,
        compute=lambda: critical_speed_map(example_machine("paper"), [1e8]).at_lines["with support mass"][1],
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
        compute=lambda: ROTOR_CASES["R12"](load_case("R12").inputs)["bending mode 3 (double)"],
        unit="Hz",
        reason="the closed form printed by NAFEMS is 283.47 Hz; Altair used finite elements",
    ),
    Disagreement(
        what="δ* at a curvature difference of 0.4795",
        source="table of contact parameters in Harris, Rolling Bearing Analysis",
        printed=0.9429,
        compute=lambda: contact_parameters(0.4795)[2],
        unit="1",
        reason="a misprint: the exact elliptic integrals give 0.9432 and the neighbouring entries agree",
    ),
)
