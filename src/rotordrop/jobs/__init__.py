"""A queue of computations on drops, each in a process of its own with limits on memory and time.

A folder holds one folder a drop: the files that were given, what each computation is at, and what it found.
Page and watcher ask for computations; whoever comes later finds what was computed.
"""
