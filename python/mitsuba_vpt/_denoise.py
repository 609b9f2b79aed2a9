"""Denoising by Intel Open Image Denoise (package ``mitsuba-oidn``), with what it invents marked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._pictures import Array


@dataclass(frozen=True)
class Denoised:
    """A picture without noise, and where it is not the rendered one's mean."""

    #: Linear: rows, columns, and red, green and blue.
    image: Array
    #: Pixels (rows, columns) that noise does not explain: there the denoiser changed the scene.
    biased: npt.NDArray[np.bool_]

    @property
    def biased_share(self) -> float:
        """The share of such pixels, from 0 to 1."""
        return float(np.mean(self.biased))


def denoise(color: Any, error: Any, *, limit: float = 4.0, albedo: Any = None, normal: Any = None) -> Denoised:
    """Denoises a linear picture and marks the pixels that are biased by it.

    ``error`` is the estimated standard error of each pixel and channel: the channels ``error.R``, ``error.G`` and
    ``error.B`` of a picture rendered with ``error_image``. A pixel is marked where a channel moved by more than
    ``limit`` standard errors: noise alone does that to one in 16,000 at 4, to more where few jitters estimated it.
    """
    try:
        import mitsuba_oidn  # noqa: PLC0415 - optional
    except ModuleNotFoundError:
        raise ImportError("denoising needs the package mitsuba-oidn: `pip install mitsuba-vpt[denoise]`") from None
    noisy, spread = (np.ascontiguousarray(np.array(values, dtype=np.float32)) for values in (color, error))
    if noisy.ndim != 3 or noisy.shape[-1] != 3 or spread.shape != noisy.shape:
        raise ValueError(
            "color and error must be of one shape (rows, columns, 3), but are "
            f"{noisy.shape} and {spread.shape}; a picture with errors holds both: image[..., :3] and image[..., 3:6]"
        )
    if not np.any(spread > 0):
        raise ValueError("nothing is known of the errors: render at least two jitters, with error_image")
    image: Array = mitsuba_oidn.denoise(noisy, albedo, normal, hdr=True)
    return Denoised(image, np.any(np.abs(image - noisy) > limit * spread, axis=-1))
