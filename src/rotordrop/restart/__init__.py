"""Whether a machine may run again after a drop: likely damage, expected costs, and the check that pays."""

from __future__ import annotations

from rotordrop.restart.assumptions import Assumptions as Assumptions
from rotordrop.restart.assumptions import load_assumptions as load_assumptions
from rotordrop.restart.card import RestartCard as RestartCard
from rotordrop.restart.card import restart_card as restart_card
