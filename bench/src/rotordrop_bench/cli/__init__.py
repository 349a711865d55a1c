"""The command ``rotordrop-bench``."""
