"""What a recorded drop says about force and stress: the result, whichever method found it."""
