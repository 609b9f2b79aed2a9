"""``python -m mitsuba_vpt`` and the script are the program: its commands, its exit codes, its pictures."""

import os
import pickle
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from conftest import PASSES, SCENE, SIZE, array, load

import mitsuba_vpt
from mitsuba_vpt import _pictures

MODULE = [sys.executable, "-m", "mitsuba_vpt"]
SCRIPT = [str(Path(sysconfig.get_path("scripts")) / "vpt")]

SMALL = ["-D", f"resx={SIZE}", "-D", f"resy={SIZE}", "-D", f"spp={PASSES}"]


def call(program, *arguments, **options):
    return subprocess.run([*program, *arguments], capture_output=True, text=True, check=False, **options)


@pytest.mark.parametrize("program", [MODULE, SCRIPT], ids=["module", "script"])
def test_offers_what_the_program_offers(program):
    whole = call(program, "--help")
    assert whole.returncode == 0
    assert "Usage: vpt" in whole.stdout
    for command in ("render", "inspect", "compare", "reproduce", "selftest", "plugin-dir"):
        assert command in whole.stdout
        assert call(program, command, "--help").returncode == 0


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--version"], 0, ""),
        (["render", "no_such_scene.xml"], 2, "no_such_scene.xml"),
        (["render", str(SCENE), "--method", "magic"], 2, "magic"),
        (["render", str(SCENE), *SMALL, "-q", "-o", "/no/such/folder/picture.exr"], 2, "/no/such/folder"),
        (["conjure"], 2, "conjure"),
    ],
)
def test_exit_codes(arguments, code, said):
    done = call(MODULE, *arguments)
    assert (done.returncode, said in done.stderr) == (code, True), done.stderr


def test_renders_what_python_renders(scalar, tmp_path):
    picture = tmp_path / "picture.exr"
    done = call(MODULE, "render", str(SCENE), *SMALL, "--seed", "5", "-o", str(picture))
    assert done.returncode == 0, done.stderr
    # The film writes half floats.
    expected = array(mi.render(load(), seed=5)).astype(np.float16).astype(np.float32)
    assert np.array_equal(_pictures.read(picture), expected)


def test_program_needs_no_launcher_where_packages_are_neighbours():
    program = mitsuba_vpt.plugin_dir() / "vpt"
    if not (program.parents[1] / "mitsuba").is_dir():
        pytest.skip("mitsuba lies in another folder than mitsuba_vpt")
    environment = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    assert call([str(program)], "--version", env=environment).returncode == 0


def test_plugin_dir_serves_mitsubas_own_program(tmp_path):
    folder = call(MODULE, "plugin-dir").stdout.strip()
    assert folder == str(mitsuba_vpt.plugin_dir())
    copied = call(MODULE, "plugin-dir", str(tmp_path / "copy")).stdout.strip()
    for index, plugins in enumerate((folder, copied)):
        picture = tmp_path / f"{index}.exr"
        mitsuba = str(Path(mi.__path__[0]) / "mitsuba")
        done = call([mitsuba], "-m", "scalar_rgb", "-a", plugins, *SMALL, "-o", str(picture), str(SCENE))
        assert done.returncode == 0, done.stderr
        assert _pictures.read(picture).mean() > 0


def test_first_ctrl_c_writes_the_picture(tmp_path):
    picture = tmp_path / "picture.exr"
    arguments = ["render", str(SCENE), *SMALL, "--passes", "1000000", "-o", str(picture)]
    process = subprocess.Popen([*MODULE, *arguments], stderr=subprocess.PIPE, start_new_session=True)
    time.sleep(3)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 0, said
    assert _pictures.read(picture).mean() > 0


def test_errors_of_run_have_a_message_and_a_code():
    with pytest.raises(mitsuba_vpt.ProgramError, match="no_such_scene") as caught:
        mitsuba_vpt.run(["render", "no_such_scene.xml"], quiet=True)
    assert caught.value.exit_code == 2
    # Workers of clusters send it home.
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.exit_code) == (str(caught.value), 2)
