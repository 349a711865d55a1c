"""What a machine is: frozen descriptions, read from and written to a TOML file with units."""

from rotordrop.elements.air import SpeedDescription
from rotordrop.elements.ball_bearing import BallBearing
from rotordrop.elements.contact import Contact
from rotordrop.elements.friction import Friction
from rotordrop.elements.magnet import ActiveMagneticBearing
from rotordrop.elements.race import Race
from rotordrop.elements.rotor import Disc, Element, Material, Rotor, Section, SectionByLength, SectionByNodes
from rotordrop.elements.sensor import Sensor
from rotordrop.elements.support import Support
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.elements.unbalance import BalanceGrade, Unbalance
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin, JointSpread, RecordedLift
from rotordrop.machine.examples import example_machine, example_names, example_path
from rotordrop.machine.loading import load_machine, loads_machine
from rotordrop.machine.machine import Machine
from rotordrop.machine.plausibility import Doubt, doubts

__all__ = [
    "ActiveMagneticBearing",
    "BalanceGrade",
    "BallBearing",
    "CalibrationDrop",
    "CalibrationOrigin",
    "Contact",
    "Disc",
    "Doubt",
    "Element",
    "Friction",
    "JointSpread",
    "Machine",
    "Material",
    "Race",
    "RecordedLift",
    "Rotor",
    "Section",
    "SectionByLength",
    "SectionByNodes",
    "Sensor",
    "SpeedDescription",
    "Support",
    "TouchdownBearing",
    "Unbalance",
    "doubts",
    "example_machine",
    "example_names",
    "example_path",
    "load_machine",
    "loads_machine",
]
