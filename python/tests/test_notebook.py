"""The example runs as a notebook, and what it shows is shown inline."""

import json
from pathlib import Path

import nbclient
import nbformat
import pytest
from conftest import ROOT

EXAMPLE = ROOT / "python" / "examples" / "first_steps.ipynb"


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """What the cells left: for each cell its outputs."""
    notebook = nbformat.read(EXAMPLE, as_version=4)
    for cell in notebook.cells:
        cell.source = cell.source.replace("../../mitsuba_scenes", str(ROOT / "mitsuba_scenes"))
    folder = tmp_path_factory.mktemp("notebook")
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    assert (folder / "first-steps-compare" / "report.html").is_file()
    return {cell.id: cell.outputs for cell in notebook.cells if cell.cell_type == "code"}


def html(outputs) -> str:
    return "".join(output.data.get("text/html", "") for output in outputs if "data" in output)


def test_committed_without_outputs():
    assert all(not cell.get("outputs") for cell in json.loads(Path(EXAMPLE).read_text())["cells"])


def test_progress_is_one_display_with_bar_and_picture(outputs):
    shown = html(outputs["step-3"])
    # Updates take the place of the first, so the last pass alone is left.
    assert shown.count("<progress") == 1
    assert 'value="1.0000"' in shown
    assert "pass 16 of 16" in shown
    assert shown.count('<img width="256" src="data:image/png;base64,') == 1


def test_picture_is_shown(outputs):
    assert "<img" in html(outputs["step-5"])


def test_report_is_shown_inline(outputs):
    assert "<iframe srcdoc=" in html(outputs["step-8"])


def test_nothing_is_printed_beside(outputs):
    streams = [output.text for cell in outputs.values() for output in cell if output.output_type == "stream"]
    assert streams == []
