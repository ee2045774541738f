"""The command line: each command calls the Python functions that a script would call, and prints the
result."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import Annotated, Any, NoReturn

import typer

from tisim.backend import choice, runtime
from tisim.cli import check, cost, describe, effects, hard, inspect, new, report, run, search, watch
from tisim.cli.usage import Command, CommandGroup, UsageError
from tisim.errors import InputError, RunError
from tisim.interrupt import exit_code, handle_signals, raise_interrupt
from tisim.streams import safe_standard_streams, say
from tisim.version import __version__

COMMANDS = (
    run.run, describe.cases, describe.explain, check.check, hard.hard, describe.doctor, effects.effects,
    new.new,
    cost.cost, search.optimize, search.compare, search.cache,
    inspect.plot, report.report, watch.watch, inspect.figures, inspect.movie, inspect.export,
)  # fmt: skip
"""The command functions, in the order of ``tisim --help``; each function name is the command name."""
WRITERS = ("run", "new", "cost", "optimize", "compare", "plot", "report", "figures", "movie", "export")
"""Commands whose results are files; they succeed even if standard output cannot be written."""

app = typer.Typer(
    cls=CommandGroup,
    help="Simulate interacting particles, and search for the design that gives a wanted result.",
    no_args_is_help=True, pretty_exceptions_enable=False, add_completion=False, rich_markup_mode=None,
)  # fmt: skip
for _command in COMMANDS:
    app.command(cls=Command)(_command)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit with 0 on success; 1 if a run or check failed; 2 for wrong input, before
    anything is run; 130, 143, 129 when stopped by Ctrl-C, SIGTERM, SIGHUP.

    Closed standard streams, and pipes whose reader has exited, do not change the exit code. If standard
    output is full, an error is reported on standard error, and the exit code becomes 1 for commands that
    print their result instead of writing files.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    with safe_standard_streams() as (out, _):
        code = _exit_code(words)
        out.flush()
        if out.complaint:
            say(f"standard output could not be written: {out.complaint}")
            command = next((word for word in words if not word.startswith("-")), "")
            code = code or int(command not in WRITERS)
    sys.exit(code)


def _exit_code(words: list[str]) -> int:
    """Run a command; return its exit code, and print the reason if it is not 0."""
    warnings.formatwarning = _one_line
    with handle_signals(raise_interrupt):
        try:
            choice.check()
            code = app(words, prog_name="tisim", standalone_mode=False)
            # Commands, and Typer for a KeyboardInterrupt, return 130 for every signal.
            return exit_code() if code == 130 else code or 0
        except UsageError as error:
            # No command was given: the message is the help text.
            say(error.format_message())
            return 2
        except InputError as error:
            say(str(error))
            return 2
        except RunError as error:
            say(str(error))
            return 1
        except MemoryError:
            say("memory must be enough for this; received no more from the system (a limit, as of ulimit -v)")
            return 1
        except OSError as error:
            say(f"{error.filename or 'a file'} could not be used: {error.strerror or error}")
            return 1
        except KeyboardInterrupt:
            return exit_code()


def _one_line(message: Warning | str, *_where: Any, **_more: Any) -> str:
    """Return the text of a warning on one line, without its location in the code."""
    text = " ".join(str(message).split())
    return f"warning: {text if text.isprintable() else repr(text)[1:-1]}\n"


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"tisim {__version__} ({runtime.backend()})")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass
