"""``compare`` measures, and hands out what was measured as arrays."""

import signal
import subprocess
import sys
import time

import mitsuba as mi
import numpy as np
import pytest
from conftest import SCENE, SIZE, load

import mitsuba_vpt


@pytest.fixture(scope="module")
def comparison(tmp_path_factory):
    return mitsuba_vpt.compare(
        SCENE,
        ["ppt", "volpath"],
        time=1.5,
        seeds=2,
        reference_method="volpath",
        reference_time=2,
        output=tmp_path_factory.mktemp("compare") / "report",
        defines={"resx": SIZE, "resy": SIZE},
        settings={"alpha": 0.8},
        quiet=True,
    )


def test_settings_reach_the_program(comparison):
    assert comparison.methods == ["ppt", "volpath"]
    assert comparison.results["settings"]["--set"] == "alpha=0.8"
    assert comparison.results["film_size"] == [SIZE, SIZE]
    assert comparison.seeds("ppt") == [0, 1]


def test_errors_are_those_of_the_pictures(comparison):
    for method in comparison.methods:
        errors = comparison.errors(method)
        assert np.all(np.diff(errors["seconds"]) > 0)
        assert np.all(np.diff(errors["work"]) >= 0)
        for index, rmse in enumerate(errors["rmse"]):
            difference = comparison.picture(method, index=index).astype(np.float64) - comparison.reference
            # Root mean square over pixels and channels; the pictures are files of single precision.
            assert rmse == pytest.approx(np.sqrt(np.mean(difference**2)), rel=1e-5)
    assert len(comparison.errors("ppt")["rmse"]) > 1


def test_last_pictures_of_all_seeds_are_kept(comparison):
    first, second = comparison.picture("ppt"), comparison.picture("ppt", seed=1)
    assert first.shape == second.shape == (SIZE, SIZE, 3)
    assert first.dtype == np.float32
    assert not np.array_equal(first, second)


def test_report_is_shown_inline(comparison):
    assert comparison.report.is_file()
    shown = comparison._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    # Whatever the report says, it stays within the attribute.
    assert shown.count('"') == 4


def test_a_folder_is_opened_again(comparison):
    again = mitsuba_vpt.Comparison(comparison.folder)
    assert again.results == comparison.results
    assert np.array_equal(again.reference, comparison.reference)


def test_what_is_not_there_is_named(comparison, tmp_path):
    with pytest.raises(LookupError, match=r"'apa' was not compared; there are ppt, volpath"):
        comparison.errors("apa")
    with pytest.raises(LookupError, match=r"ppt did not run with seed 7; it did with \[0, 1\]"):
        comparison.picture("ppt", seed=7)
    with pytest.raises(FileNotFoundError, match=r"results\.json"):
        mitsuba_vpt.Comparison(tmp_path)


def test_scenes_without_a_file_are_refused_with_a_mend_that_works(scalar, tmp_path, monkeypatch):
    scene = {
        "type": "scene",
        "integrator": {"type": "vpt"},
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
        "light": {"type": "constant"},
        "ball": {"type": "sphere", "center": [0, 0, 5]},
    }
    with pytest.raises(TypeError, match="give that path") as refused:
        mitsuba_vpt.compare(scene)
    monkeypatch.chdir(tmp_path)
    eval(str(refused.value).split("`")[1], {"mi": mi, "scene": scene})
    mitsuba_vpt.run(["render", "scene.xml", "--passes", "1", "-o", "picture.exr"], quiet=True)
    with pytest.raises(TypeError, match="give the path of its XML"):
        mitsuba_vpt.compare(load())


INTERRUPTED = """
import signal, sys, mitsuba_vpt
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    mitsuba_vpt.compare(sys.argv[1], ["ppt"], time=1000, seeds=1, reference=sys.argv[2], output=sys.argv[3],
                        defines={"resx": 24, "resy": 24})
except KeyboardInterrupt:
    print("interrupted")
"""


def test_ctrl_c_leaves_what_was_measured(comparison, tmp_path):
    folder = tmp_path / "report"
    reference = comparison.folder / "images" / "reference.exr"
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, str(SCENE), str(reference), str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not list(folder.glob("images/ppt/*.exr")):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    said, error = process.communicate(timeout=60)
    assert (process.returncode, said) == (0, "interrupted\n"), error
    interrupted = mitsuba_vpt.Comparison(folder)
    assert interrupted.results["interrupted"]
    assert len(interrupted.errors("ppt")["rmse"]) > 0
    assert interrupted.report.is_file()


def test_a_refusal_of_the_program_is_raised(tmp_path):
    with pytest.raises(mitsuba_vpt.ProgramError, match="magic"):
        mitsuba_vpt.compare(SCENE, ["magic"], output=tmp_path / "report", quiet=True)
