"""The log of a machine's drops: what its touchdown bearings went through, and what share of an allowance."""

from __future__ import annotations

from rotordrop.ledger.book import LoggedDrop as LoggedDrop
from rotordrop.ledger.book import Severity as Severity
from rotordrop.ledger.book import add_drop as add_drop
from rotordrop.ledger.book import allow as allow
from rotordrop.ledger.book import logged_drops as logged_drops
from rotordrop.ledger.book import trends as trends
from rotordrop.ledger.book import used_shares as used_shares
