"""The part of the plugin's C ABI (include/vpt.h) that watches a render."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_char_p, c_double, c_float, c_int32, c_size_t, c_uint32, c_uint64, c_void_p

#: Of the header that this page was written after.
VERSION = 11


class Shooting(ctypes.Structure):
    """VptShooting."""

    _fields_ = [
        ("mode", c_uint32),
        ("visible_share", c_double),
        ("acceptance", c_double),
        ("mutation_size", c_float),
    ]


class Error(ctypes.Structure):
    """VptError."""

    _fields_ = [
        ("relative", c_double),
        ("noise", c_double),
        ("bias", c_double),
        ("noise_decay", c_double),
        ("bias_decay", c_double),
        ("correlation", c_double),
        ("jitters", c_uint32),
    ]


ReadFilmFunction = ctypes.CFUNCTYPE(c_int32, c_void_p, POINTER(c_double), c_size_t, c_char_p, c_size_t)


class Progress(ctypes.Structure):
    """VptProgress."""

    _fields_ = [
        ("passes_done", c_uint32),
        ("passes", c_uint32),
        ("walks", c_uint64),
        ("surface_radius", c_float),
        ("medium_radius", c_float),
        ("seconds", c_double),
        ("surface_shooting", Shooting),
        ("medium_shooting", Shooting),
        ("error", Error),
        ("film_size", c_uint32 * 2),
        ("film_channels", c_uint32),
        ("film", c_void_p),
        ("read_film", ReadFilmFunction),
    ]


ProgressFunction = ctypes.CFUNCTYPE(c_int32, c_void_p, POINTER(Progress))
FinishedFunction = ctypes.CFUNCTYPE(None, c_void_p, c_void_p)
WarnFunction = ctypes.CFUNCTYPE(None, c_void_p, c_char_p)


class Observer(ctypes.Structure):
    """VptObserver."""

    _fields_ = [
        ("context", c_void_p),
        ("progress", ProgressFunction),
        ("finished", FinishedFunction),
        ("warn", WarnFunction),
    ]
