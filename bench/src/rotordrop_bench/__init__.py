"""Simulated recordings of drops with hidden truth, and scoring of estimates against it.

Nothing here was measured: a machine is drawn around the description its owner has, its drop is simulated
with a finer model than any estimator uses, and a sensor chain makes a recording of it. The truth is kept
apart. DropBench is a fixed list of such drops, and the table that scores estimators on it.
"""

from rotordrop_bench.drops import DROPS, VERSION, BenchDrop
from rotordrop_bench.event import DropConditions, HiddenMachine, hidden_machine
from rotordrop_bench.faults import FAULTS, with_fault
from rotordrop_bench.files import write_synthetic
from rotordrop_bench.make import make_bench
from rotordrop_bench.recording import SyntheticDrop, synthesize_drop
from rotordrop_bench.score import score_estimate
from rotordrop_bench.sensor_chain import SensorChain
from rotordrop_bench.table import BenchScores, score_bench
from rotordrop_bench.truth import Truth, read_truth
from rotordrop_bench.violations import Violations, load_violations

__all__ = [
    "DROPS",
    "FAULTS",
    "VERSION",
    "BenchDrop",
    "BenchScores",
    "DropConditions",
    "HiddenMachine",
    "SensorChain",
    "SyntheticDrop",
    "Truth",
    "Violations",
    "hidden_machine",
    "load_violations",
    "make_bench",
    "read_truth",
    "score_bench",
    "score_estimate",
    "synthesize_drop",
    "with_fault",
    "write_synthetic",
]
