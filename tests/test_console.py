"""Progress bars: compilation is reported."""

import numpy as np

from tests.scenes import fixed, scene
from tisim import Simulation
from tisim.compiling import compiling, is_compiling
from tisim.console import Compiling, progress_bar
from tisim.effects import Tether
from tisim.program.launched_program import LaunchedProgram


def test_a_bar_reports_compilation():
    """Compilation may begin within compilation, for example for lists that have grown."""
    with progress_bar("run") as bar:
        bar.add_task("")
        (column,) = [one for one in bar.columns if isinstance(one, Compiling)]
        said = [column.render(bar.tasks[0]).plain]
        with compiling(), compiling():
            said.append(column.render(bar.tasks[0]).plain)
        said.append(column.render(bar.tasks[0]).plain)
    assert said == ["", "compiling", ""]


def test_making_a_simulation_reports_compilation(monkeypatch):
    said, compile_program = [], LaunchedProgram.compile

    def noted(program):
        said.append(is_compiling())
        compile_program(program)

    monkeypatch.setattr(LaunchedProgram, "compile", noted)
    tether = Tether(stiffness=(1.0, 1.0, 1.0))
    one = scene(np.zeros((1, 3)), np.ones((1, 3)), (tether,), stepper=fixed(0.1), steps=1)
    Simulation(one, schedule="particle").close()
    assert said
    assert all(said)
    assert not is_compiling()
