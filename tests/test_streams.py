"""A stream that fails loses text and nothing else."""

import errno
import io
import os
import subprocess
import sys

import pytest

from tisim import console, streams
from tisim.streams import SafeStream, say


class Failing(io.StringIO):
    """A stream whose writes raise this error."""

    def __init__(self, error):
        super().__init__()
        self.error = error

    def write(self, text):
        raise self.error


@pytest.mark.parametrize(
    ("error", "complaint"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
        (OSError(errno.EIO, "Input/output error"), "Input/output error"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), ""),
        (ValueError("I/O operation on closed file"), "I/O operation on closed file"),
    ],
)
def test_a_failing_stream_is_reported(error, complaint):
    stream = SafeStream(Failing(error))
    assert stream.write("some text") == 9
    stream.flush()
    assert stream.failure is error
    assert stream.complaint == complaint


def test_text_that_cannot_be_encoded_is_escaped():
    raw = io.BytesIO()
    stream = SafeStream(io.TextIOWrapper(raw, encoding="ascii"))
    print("1 µm", "5", sep=", ", file=stream)
    stream.flush()
    assert raw.getvalue() == b"1 \\xb5m, 5\n"
    assert stream.failure is None
    with pytest.raises(TypeError, match="takes str, not bytes"):
        stream.write(b"bytes")


class Notebook:
    """A replacement for a stream in a notebook or an editor, which supports only writing."""

    def __init__(self):
        self.text = ""

    def write(self, text):
        self.text += text


@pytest.mark.parametrize("stream", [None, Notebook()])
def test_consoles_and_bars_accept_any_stream(monkeypatch, stream):
    monkeypatch.setattr(sys, "stdout", stream)
    monkeypatch.setattr(sys, "stderr", stream)
    console.out().print("a table")
    with console.progress_bar("run") as bar:
        bar.add_task("", total=1.0)
    console.print_stopping()
    if stream is not None:
        assert "a table" in stream.text
        assert "stopping at the next good moment" in stream.text


def test_names_that_would_control_the_terminal_are_printed_as_escapes(capsys):
    """In text, tables, progress bars and messages."""
    name = "\x1b[31mRED\x1b[0m\x1b]0;title\x07"
    shown = r"\x1b[31mRED\x1b[0m\x1b]0;title\x07"
    console.out().print(f"scene: {name}\nsecond line")
    table = console.plain_table()
    table.add_row("name", name)
    console.out().print(table)
    with console.progress_bar("{task.description}") as bar:
        bar.add_task(name, total=1.0)
    say(f"line 2 must be a number; received {name}")
    out, err = capsys.readouterr()
    assert out.count(shown) == 2
    assert err.count(r"\x1b[31mRED") == 2
    assert "\x1b" not in out + err
    assert out.splitlines()[1] == "second line"


CLOSED = """
import os, sys
from tisim.streams import fill_standard_descriptors
fill_standard_descriptors()
file = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT)
for descriptor in (1, 2):
    os.write(descriptor, b"what a library prints")
os.write(file, b"data")
"""


def test_a_file_never_gets_the_number_of_a_closed_stream(tmp_path):
    """Output printed to that descriptor would go into the file."""

    def close():
        os.closerange(0, 3)

    path = tmp_path / "data"
    done = subprocess.run([sys.executable, "-c", CLOSED, str(path)], preexec_fn=close, check=False)
    assert done.returncode == 0
    assert path.read_bytes() == b"data"


def test_standard_streams_are_restored(monkeypatch, capsys):
    before = sys.stdout, sys.stderr
    with streams.safe_standard_streams() as (out, _):
        assert sys.stdout is out
        print("text")
    assert (sys.stdout, sys.stderr) == before
    assert capsys.readouterr().out == "text\n"
