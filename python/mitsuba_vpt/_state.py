"""How far a render is, and its film while it stands still."""

from __future__ import annotations

import ctypes
import threading
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _abi
from ._pictures import Array


class Film:
    """The film of a render that stands still while its callback runs."""

    def __init__(self, raw: _abi.Progress) -> None:
        self._raw: _abi.Progress | None = raw
        self._thread = threading.get_ident()

    def close(self) -> None:
        """The render goes on."""
        self._raw = None

    def image(self) -> Array:
        """The picture, as Mitsuba develops it but for the last bit."""
        raw = self._raw
        if raw is None or self._thread != threading.get_ident():
            raise RuntimeError("the picture so far is there during the callback alone, on its thread: ask for it there")
        width, height = raw.film_size
        sums = np.empty((height, width, raw.film_channels), dtype=np.float64)
        error = ctypes.create_string_buffer(1024)
        storage = sums.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        read_film: Any = raw.read_film
        if read_film(raw.film, storage, sums.size, error, len(error)) != 0:
            raise RuntimeError(f"vpt: {error.value.decode(errors='replace')}")
        values, weight = sums[..., :3].astype(np.float32), sums[..., -1:].astype(np.float32)
        return np.divide(values, weight, out=np.zeros_like(values), where=weight != 0)


@dataclass(frozen=True)
class Progress:
    """How far a render is after a pass."""

    #: Passes done, at least 1.
    passes_done: int
    #: Passes asked for.
    passes: int
    #: Wall time since the render began [s].
    seconds: float
    #: Estimated relative error of the picture so far (0.01 is 1 %); None while nothing is known.
    error: float | None
    #: Its two parts: what further passes average out, and what narrower kernels take away.
    noise: float | None
    bias: float | None
    #: Photon walks so far.
    walks: int
    #: Radii of the next pass, in the scene's unit of length.
    surface_radius: float
    medium_radius: float
    _film: Film = field(repr=False, compare=False)

    def image(self) -> Array:
        """The linear picture so far: rows, columns, and red, green and blue. To be asked for within the callback.

        It costs time, about that of splatting a jitter, and only if it is asked for.
        """
        return self._film.image()

    @classmethod
    def _read(cls, raw: _abi.Progress, film: Film) -> Progress:
        known = raw.error.jitters > 0
        return cls(
            passes_done=raw.passes_done,
            passes=raw.passes,
            seconds=raw.seconds,
            error=raw.error.relative if known else None,
            noise=raw.error.noise if known else None,
            bias=raw.error.bias if known else None,
            walks=raw.walks,
            surface_radius=raw.surface_radius,
            medium_radius=raw.medium_radius,
            _film=film,
        )
