"""The parts of a machine, one file each: what a part is, what is unknown of it, what it does at rest."""
