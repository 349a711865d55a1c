"""Many drops: ensembles and sweeps, resumable, with the same numbers however they are computed."""
