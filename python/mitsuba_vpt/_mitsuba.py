"""The one Mitsuba that the plugin was built for."""

from __future__ import annotations

import importlib

#: As in mitsuba.lock.
REQUIRED = "3.9.1"

MEND = f"`pip install mitsuba=={REQUIRED}`"


def require_mitsuba() -> None:
    """Raises ImportError unless the Mitsuba that would be imported is the one that is needed."""
    try:
        mitsuba = importlib.import_module("mitsuba")
    except ModuleNotFoundError as error:
        if error.name != "mitsuba":
            raise
        raise ImportError(f"mitsuba_vpt needs Mitsuba {REQUIRED}, but none is installed; {MEND}") from None
    found = getattr(mitsuba, "__version__", "an unknown version")
    if found != REQUIRED:
        raise ImportError(
            f"mitsuba_vpt is a plugin for Mitsuba {REQUIRED}, but {found} is installed in "
            f"{getattr(mitsuba, '__path__', ['?'])[0]}; {MEND}, or install a mitsuba-vpt that was built for {found}"
        )
