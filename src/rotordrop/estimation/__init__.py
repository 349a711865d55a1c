"""From a recorded drop to force and stress, with their uncertainty."""
