"""``python -m mitsuba_vpt``, and the script ``vpt``: all that the program offers, with its exit codes."""

from __future__ import annotations

import os
import sys

from ._program import PROGRAM, environment


def main() -> None:
    """Becomes the program."""
    sys.stdout.flush()
    sys.stderr.flush()
    os.execve(PROGRAM, ["vpt", *sys.argv[1:]], environment())


if __name__ == "__main__":
    main()
