"""A folder that is watched: every record that arrives is kept, estimated, logged and reported, once."""

from __future__ import annotations

from rotordrop.watch.fleet import Fleet as Fleet
from rotordrop.watch.fleet import read_fleet as read_fleet
from rotordrop.watch.kept import Kept as Kept
from rotordrop.watch.watcher import Watcher as Watcher
