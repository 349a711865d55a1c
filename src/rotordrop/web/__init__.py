"""The local page: drop a machine file and a record on it, look at the drop, estimate it, read the report.

A server for this computer alone. It parses no file itself: every one that came in is read by a child process
with limits, and what the child found lies in a folder, from which any later server shows it again.
"""
