"""Simulated recordings of drops with hidden truth, and scoring of estimates against it.

Nothing here was measured: a machine is drawn around the description its owner has, its drop is simulated
with a finer model than any estimator uses, and a sensor chain makes a recording of it. The truth is kept
apart.
"""

from rotordrop.synthesis.event import DropConditions, HiddenMachine, hidden_machine
from rotordrop.synthesis.faults import FAULTS, with_fault
from rotordrop.synthesis.files import write_synthetic
from rotordrop.synthesis.recording import SyntheticDrop, synthesize_drop
from rotordrop.synthesis.score import score_estimate
from rotordrop.synthesis.sensor_chain import SensorChain
from rotordrop.synthesis.truth import Truth, read_truth
from rotordrop.synthesis.violations import VIOLATIONS, Violations, load_violations

__all__ = [
    "FAULTS",
    "VIOLATIONS",
    "DropConditions",
    "HiddenMachine",
    "SensorChain",
    "SyntheticDrop",
    "Truth",
    "Violations",
    "hidden_machine",
    "load_violations",
    "read_truth",
    "score_estimate",
    "synthesize_drop",
    "with_fault",
    "write_synthetic",
]
