"""The plugin's library, loaded into this process once."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path

import mitsuba

from . import _abi

FOLDER = Path(__file__).resolve().parent
LIBRARY = FOLDER / "plugins" / "vpt.so"


def plugin_dir() -> Path:
    """The folder for ``mitsuba -a DIR``, Mitsuba's own program."""
    return FOLDER


@functools.cache
def library() -> ctypes.CDLL:
    """The plugin, with the types of its functions."""
    # The libraries that it needs must be loaded by then: these are Mitsuba's own, wherever it lies.
    assert mitsuba.__version__
    try:
        loaded = ctypes.CDLL(str(LIBRARY))
    except OSError as error:
        raise ImportError(f"the plugin of mitsuba_vpt cannot be loaded: {error}; install mitsuba-vpt anew") from None
    loaded.vpt_abi_version.restype = ctypes.c_uint32
    loaded.vpt_abi_version.argtypes = []
    if loaded.vpt_abi_version() != _abi.VERSION:
        raise ImportError(
            f"{LIBRARY} has version {loaded.vpt_abi_version()} of the plugin's ABI, but this mitsuba_vpt was written "
            f"for {_abi.VERSION}; install mitsuba-vpt anew"
        )
    loaded.vpt_install.restype = ctypes.c_int32
    loaded.vpt_install.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    loaded.vpt_watch.restype = ctypes.c_void_p
    loaded.vpt_watch.argtypes = [ctypes.c_void_p]
    return loaded


def install() -> None:
    """Makes Mitsuba know the integrator in all variants, whatever its file resolver looks through."""
    error = ctypes.create_string_buffer(1024)
    if library().vpt_install(error, len(error)) != 0:
        raise ImportError(f"Mitsuba refused the plugin vpt: {error.value.decode(errors='replace')}")
