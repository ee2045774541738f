"""The command line is thin: a command calls what a script would call, and prints it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated, NoReturn

import typer

from tisim.backend import choice, runtime
from tisim.cli import cost, describe, effects, inspect, new, run, search
from tisim.cli.usage import Command, CommandGroup, UsageError
from tisim.errors import InputError, RunError
from tisim.interrupt import exit_code, handle_signals, raise_interrupt
from tisim.version import __version__

COMMANDS = (
    run.run, describe.cases, describe.explain, describe.check, describe.doctor, effects.effects, new.new,
    cost.cost, search.optimize, search.compare, search.cache,
    inspect.plot, inspect.figures, inspect.movie, inspect.export,
)  # fmt: skip
"""The functions of all commands, whose names they have, in the order of ``tisim --help``."""

app = typer.Typer(
    cls=CommandGroup,
    help="Clouds of interacting particles, and a genetic algorithm that designs them backwards.",
    no_args_is_help=True, pretty_exceptions_enable=False, add_completion=False, rich_markup_mode=None,
)  # fmt: skip
for _command in COMMANDS:
    app.command(cls=Command)(_command)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit: with 0 when it is done; 1 when a run or check failed; 2 at wrong input, when
    nothing was run; 130, 143, 129 when stopped by Ctrl-C, SIGTERM, SIGHUP.
    """
    code = 0
    with handle_signals(raise_interrupt):
        try:
            choice.check()
            code = app(arguments, prog_name="tisim", standalone_mode=False)
            # 130 is what commands, and Typer for a KeyboardInterrupt, say whatever the signal was.
            code = exit_code() if code == 130 else code
        except UsageError as error:
            # No command was named: this is the help.
            print(error.format_message(), file=sys.stderr)
            code = 2
        except InputError as error:
            print(error, file=sys.stderr)
            code = 2
        except RunError as error:
            print(error, file=sys.stderr)
            code = 1
        except KeyboardInterrupt:
            code = exit_code()
    sys.exit(code or 0)


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
