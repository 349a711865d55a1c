"""Simulated recordings of drops with hidden truth, and scoring of estimates against it.

Nothing here was measured: a machine is drawn around the description its owner has, its drop is simulated
with a finer model than any estimator uses, and a sensor chain makes a recording of it. The truth is kept
apart. DropBench is a fixed list of such drops, the corpus compares versions of the estimator.
"""

from rotordrop_bench.corpus.cases import DROPS, VERSION, chosen_drops, made
from rotordrop_bench.corpus.run import score_all
from rotordrop_bench.event import HiddenMachine, hidden_machine
from rotordrop_bench.recording import SyntheticDrop, synthesize_drop
from rotordrop_bench.score import read_truth, score_estimate
from rotordrop_bench.sensor_chain import SensorChain
from rotordrop_bench.violations import Violations, load_violations

__all__ = [
    "DROPS",
    "VERSION",
    "HiddenMachine",
    "SensorChain",
    "SyntheticDrop",
    "Violations",
    "chosen_drops",
    "hidden_machine",
    "load_violations",
    "made",
    "read_truth",
    "score_all",
    "score_estimate",
    "synthesize_drop",
]
