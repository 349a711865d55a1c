"""What is known when a machine is to run again after a drop: evidence of damage, next drop, lift, checks."""

from __future__ import annotations

from rotordrop.restart.card import RestartCard as RestartCard
from rotordrop.restart.card import restart_card as restart_card
