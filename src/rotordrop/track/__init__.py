"""State estimation: a drop model that follows a recording sample by sample."""
