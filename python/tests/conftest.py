"""What tests share: small scenes, and Mitsuba's variants."""

import os
import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_vpt

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "mitsuba_scenes" / "cornell_fog" / "scene.xml"

#: Of the scene as tests render it.
SIZE = 24
PASSES = 3


def has_llvm() -> bool:
    """Whether Dr.Jit can compile: asked of a process of its own, for a failure to load stays."""
    code = "import mitsuba as mi; mi.set_variant('llvm_ad_rgb'); import drjit as dr; dr.eval(mi.Float([1, 2]) + 1)"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0


#: Without LLVM its tests are skipped, unless the environment says that they must not be.
LLVM = os.environ.get("VPT_REQUIRE_LLVM") == "1" or has_llvm()


@pytest.fixture(params=["scalar_rgb", "llvm_ad_rgb"])
def variant(request):
    """A variant of Mitsuba, set."""
    if request.param.startswith("llvm") and not LLVM:
        pytest.skip("there is no libLLVM")
    mi.set_variant(request.param)
    return request.param


@pytest.fixture
def scalar():
    """The variant whose bits depend on the seed alone."""
    mi.set_variant("scalar_rgb")


def load(**parameters):
    """The scene of the tests, small."""
    return mi.load_file(str(SCENE), **{"resx": str(SIZE), "resy": str(SIZE), "spp": str(PASSES), **parameters})


def array(image) -> np.ndarray:
    """A rendered image as a plain array."""
    return np.array(image, dtype=np.float32)


def python(code: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
    """Runs code in a fresh interpreter, where nothing is imported yet."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


assert mitsuba_vpt.MITSUBA_VERSION == mi.__version__
