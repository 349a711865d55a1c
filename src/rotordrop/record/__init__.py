"""One recorded drop: reading it, and its channels in SI units on one clock."""
