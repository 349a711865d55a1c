"""``python -m rotordrop`` is the command ``rotordrop``."""

from rotordrop.cli.app import main

if __name__ == "__main__":
    main()
