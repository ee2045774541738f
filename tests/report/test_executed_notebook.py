"""The snippets of docs/notebooks.md in a real notebook, if Jupyter is installed (nbclient and ipykernel)."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs/notebooks.md"
SHOWN = ("scene", "result", "trajectory", "result.view()", "trajectory.view(height=500)")
"""Cells after the snippets, each with an object that shows itself."""


@pytest.mark.slow
def test_the_snippets_run_in_a_notebook_and_objects_show_themselves(tmp_path):
    nbformat = pytest.importorskip("nbformat", reason="needs nbclient and ipykernel")
    nbclient = pytest.importorskip("nbclient", reason="needs nbclient and ipykernel")
    pytest.importorskip("ipykernel", reason="needs nbclient and ipykernel")
    scripts = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    cells = [nbformat.v4.new_code_cell(text) for text in (*scripts, *SHOWN)]
    notebook = nbformat.v4.new_notebook(cells=cells)
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    outputs = {cell.source: cell.outputs for cell in notebook.cells}
    for name in SHOWN:
        (output,) = outputs[name]
        assert set(output.data) == {"text/plain", "text/html"}, name
        assert len(output.data["text/plain"].splitlines()) == 1
    assert 'sandbox="allow-scripts allow-downloads"' in outputs["result.view()"][0].data["text/html"]
    bar = [one for one in outputs[scripts[1]] if "100%" in one.get("data", {}).get("text/plain", "")]
    assert len(bar) == 1, "the progress of the run is one output, without widgets"
