"""``import mitsuba_vpt`` alone makes the integrator known, and refuses other Mitsubas by name."""

import re
import threading
from importlib.metadata import distribution

import mitsuba as mi
import pytest
from conftest import LLVM, ROOT, SCENE, array, load, python

import mitsuba_vpt

RENDER = """
scene = mi.load_file(sys.argv[1], resx="8", resy="8", spp="1")
assert "VptIntegrator" in str(scene.integrator()), scene.integrator()
print(float(mi.TensorXf(mi.render(scene)).array[0]))
"""

ORDERS = {
    "before_the_variant": "import sys, mitsuba_vpt, mitsuba as mi; mi.set_variant(V)",
    "after_the_variant": "import sys, mitsuba as mi; mi.set_variant(V); import mitsuba_vpt",
    "between_two_variants": (
        "import sys, mitsuba as mi; mi.set_variant('scalar_spectral'); import mitsuba_vpt; mi.set_variant(V)"
    ),
}


@pytest.mark.parametrize("order", ORDERS)
def test_xml_renders(order, variant):
    done = python(f"V = {variant!r}\n{ORDERS[order]}\n{RENDER}", str(SCENE))
    assert done.returncode == 0, done.stderr


#: What the plugin works in; whether a GPU is there is another question.
SUPPORTED = [name for name in mi.variants() if "polarized" not in name and not name.startswith("cuda")]


@pytest.mark.parametrize("name", SUPPORTED)
def test_every_supported_variant_renders(name):
    if name.startswith("llvm") and not LLVM:
        pytest.skip("there is no libLLVM")
    done = python(f"V = {name!r}\n{ORDERS['before_the_variant']}\n{RENDER}", str(SCENE))
    assert done.returncode == 0, done.stderr


def test_dict_renders(variant):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "vpt", "max_depth": 3},
            "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
            "light": {"type": "constant"},
            "ball": {"type": "sphere", "center": [0, 0, 5]},
        }
    )
    # Where the ball is not, the sky of radiance 1 is seen.
    assert array(mi.render(scene, spp=2))[0, 0] == pytest.approx([1, 1, 1], rel=1e-5)


def test_a_later_file_resolver_changes_nothing(scalar):
    former = mi.file_resolver()
    try:
        mi.set_file_resolver(mi.FileResolver())
        assert mi.load_dict({"type": "vpt"}).class_name() == "VptIntegrator"
    finally:
        mi.set_file_resolver(former)


def test_other_threads_know_it(scalar):
    names = []
    thread = threading.Thread(target=lambda: names.append(mi.load_dict({"type": "vpt"}).class_name()))
    thread.start()
    thread.join()
    assert names == ["VptIntegrator"]


def test_unsupported_variants_are_refused_by_name():
    mi.set_variant("scalar_spectral_polarized")
    with pytest.raises(RuntimeError, match=r"vpt works in .*scalar_rgb"):
        mi.load_dict({"type": "vpt"})


def test_other_mitsuba_is_refused_by_name(tmp_path):
    package = tmp_path / "mitsuba"
    package.mkdir()
    (package / "__init__.py").write_text("__version__ = '3.8.0'")
    done = python("import mitsuba_vpt", PYTHONPATH=str(tmp_path))
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("ImportError: ")
    for part in ("3.8.0", str(package), f"pip install mitsuba=={mitsuba_vpt.MITSUBA_VERSION}"):
        assert part in last


def test_no_mitsuba_is_refused_by_name():
    done = python("import sys; sys.modules['mitsuba'] = None; import mitsuba_vpt")
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert "none is installed" in last
    assert f"pip install mitsuba=={mitsuba_vpt.MITSUBA_VERSION}" in last


def test_versions_are_those_of_the_lock():
    locked = re.search(r"^mitsuba==(\S+)", (ROOT / "mitsuba.lock").read_text(), re.MULTILINE)[1]
    assert locked == mitsuba_vpt.MITSUBA_VERSION
    requirements = distribution("mitsuba-vpt").requires
    assert f"mitsuba=={locked}" in requirements


def test_integrator_in_xml_has_its_parameters(scalar):
    assert "max_depth = 24" in str(load().integrator())
