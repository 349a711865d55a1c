"""Frequencies of a coast-down: waterfall, orders, lines and their names, speed, indentation."""
