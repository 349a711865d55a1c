"""DropBench: a fixed list of simulated drops with hidden truth, and the table that scores estimators."""

from rotordrop.synthesis.bench.drops import DROPS, VERSION, BenchDrop
from rotordrop.synthesis.bench.make import make_bench
from rotordrop.synthesis.bench.table import BenchScores, score_bench

__all__ = ["DROPS", "VERSION", "BenchDrop", "BenchScores", "make_bench", "score_bench"]
