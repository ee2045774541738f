"""The snippets of the guides run as printed, in order."""

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tisim.cli.main import main

DOCS = Path(__file__).parents[1] / "docs"
GUIDES = [DOCS / "tutorial.md", *sorted((DOCS / "guides").glob("*.md"))]
PRINTED = {
    "tutorial": r"reached its end after 15 steps\n"
    r"middle of the jet: x = 22.77 mm, z = 4.53 mm\n"
    r"400000 V/m: 2.28 mm above the axis\n600000 V/m: 3.40 mm above the axis\n"
    r"800000 V/m: 4.53 mm above the axis\n"
    r"11 frames of 12 droplets\n"
    r"[^@]*?"
    r"error below 0.01: Boris, FixedStep: dt dt=0.00133, 2 force evaluations\n"
    r"error below 0.001: Boris, FixedStep: dt dt=0.000421, 5 force evaluations\n"
    r"error below 0.0001: Boris, FixedStep: dt dt=0.000133, 16 force evaluations\n"
    r"error below 1e-06: Collocation\(stages=3\), StageControl: error error=0.0133, 30 force evaluations\n"
    r"\d+ runs: 16.\d\d m/s and 7.\d\de\+05 V/m\n"
    r"miss 0.\d\d mm, 95 % interval 0.\d\d to 0.\d\d mm\n",
    "simulation": r"(hardness \d{6} Pa: [\d.]+ grains are left\n){3}"
    r"at 0.0004\d* s, 4\d% is done\n"
    r"0%, 200 grains\n(\d+%, \d+ grains\n)*100%, \d+ grains\n"
    r"\d+% of the energy of motion is left\n"
    r"velocity at t = 0.0005\d* s\n"
    r"21 frames, the last at 0.001 s\n"
    r"0.0005\d* s: \d+ grains\n",
}
"""The output of a guide."""
SNIPPET = re.compile(r'^```(\w+)(?: title="([\w.]+)")?\n(.*?)^```$', re.M | re.S)


def console(text):
    """Run the commands of a snippet; all must succeed."""
    for line in text.splitlines():
        dollar, program, *arguments = shlex.split(line)
        assert dollar == "$"
        if program == "python":
            subprocess.run([sys.executable, *arguments], check=True)
            continue
        assert program == "tisim"
        with pytest.raises(SystemExit) as end:
            main(arguments)
        assert end.value.code == 0, line


@pytest.mark.slow
@pytest.mark.parametrize("guide", GUIDES, ids=lambda path: path.stem)
def test_snippets_run_as_printed(guide, own_file, tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(tmp_path))
    snippets = SNIPPET.findall(guide.read_text(encoding="utf-8"))
    assert len(snippets) == guide.read_text(encoding="utf-8").count("\n```") / 2
    names = {"__name__": "__main__"}
    for language, title, text in snippets:
        if title:
            own_file(title, text)
            sys.modules.pop(Path(title).stem, None)
        elif language == "console":
            console(text)
        else:
            exec(compile(text, guide.name, "exec"), names)
        if language == "toml":
            assert tomllib.loads(text)
    if guide.stem in PRINTED:
        assert re.fullmatch(PRINTED[guide.stem], capsys.readouterr().out)
