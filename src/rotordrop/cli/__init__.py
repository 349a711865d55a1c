"""The command line: one file per verb, loaded only when the verb is called.

A verb ``coast-down`` is the function ``coast_down`` in ``coast_down.py``; the first line of that file is what
``rotordrop --help`` shows. Files whose name begins with an underscore are shared by the verbs.
"""

INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 plus the number of the signal, the standard of shells."""

STOPPED = "stopped; nothing was left half written"
