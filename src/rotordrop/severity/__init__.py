"""How severe a drop was: statistics of stress, comparison of drops, exposure of the bearing."""
