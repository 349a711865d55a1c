"""How severe a drop was: statistics of stress, comparison of drops."""
