"""Error messages for wrong command-line arguments, in the form "X must be Y; received Z"."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup
from typer.models import ParameterInfo

from tisim.errors import InputError, abbreviated, did_you_mean

_exceptions: Any = sys.modules[typer.BadParameter.__module__]
"""The module of typer's exceptions: typer's own or click's, depending on the version."""
UsageError: Any = _exceptions.UsageError
"""Exception that typer raises for unknown arguments, and to show the help if there are none."""
RULES = {int: "a whole number", float: "a number", Path: "a path that this system can have"}
"""The rule for an argument of each type; text has none."""


class Command(TyperCommand):
    """A command that raises InputError for wrong arguments."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Return the remaining arguments, of which there are none; options and arguments are stored in the
        context."""
        words = list(args)
        try:
            return super().parse_args(ctx, args)
        except UsageError as error:
            raise InputError(_fault(self, ctx, words, error)) from None


class CommandGroup(TyperGroup):
    """The group of all commands: an unknown command, or an option before it, is an InputError."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Return the arguments from the command name on."""
        words = list(args)
        try:
            return super().parse_args(ctx, args)
        except (_exceptions.NoSuchOption, _exceptions.BadOptionUsage) as error:
            raise InputError(_fault(self, ctx, words, error)) from None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name of the command, the command, and the arguments after it."""
        try:
            return super().resolve_command(ctx, args)
        except UsageError:
            known, word = list(self.commands), args[0]
            raise InputError(
                f"command must be one of {', '.join(known)}; received {abbreviated(word)}"
                f"{did_you_mean(word, known)}"
            ) from None


def _fault(command: Any, ctx: Any, words: Sequence[str], error: Any) -> str:
    """Return the message for an error that typer raised on these arguments."""
    if isinstance(error, _exceptions.NoSuchOption):
        known = [
            name for parameter in command.get_params(ctx) for name in _names(parameter) if name[0] == "-"
        ]
        suggestion = did_you_mean(error.option_name, known)
        rule = f"one of '{ctx.command_path} --help'"
        return f"option must be {rule}; received {abbreviated(error.option_name)}{suggestion}"
    if isinstance(error, _exceptions.BadOptionUsage):
        given = next((word for word in words if word.startswith(f"{error.option_name}=")), None)
        if given is not None:
            return f"{error.option_name} must be given without a value; received {abbreviated(given)}"
        return f"{error.option_name} must be given with a value; received nothing"
    if isinstance(error, _exceptions.MissingParameter):
        text = f" ({error.param.help.rstrip('.')})" if error.param.help else ""
        return f"{_argument(error.param)} must be given{text}; received nothing"
    values, surplus, _ = command.make_parser(ctx).parse_args(list(words))
    if isinstance(error, _exceptions.BadParameter):
        parameter = error.param
        name = _argument(parameter) if _is_argument(parameter) else max(_names(parameter), key=len)
        rule = _rule(command, parameter.name)
        return f"{name} must be {rule}; received {abbreviated(values[parameter.name])}"
    arguments = list(filter(_is_argument, command.params))
    rule = f"{' '.join(map(_argument, arguments))} and no more" if arguments else "none"
    return f"arguments must be {rule}; received also {', '.join(map(abbreviated, surplus))}"


def _is_argument(parameter: Any) -> bool:
    return parameter.param_type_name == "argument"


def _argument(parameter: Any) -> str:
    """Return the name of an argument as shown in the help."""
    return parameter.metavar or parameter.name.upper()


def _names(parameter: Any) -> list[str]:
    """Return the names of a parameter as typed on the command line."""
    return [*parameter.opts, *parameter.secondary_opts]


def _rule(command: Any, name: str) -> str:
    """Return the rule that values of a parameter must satisfy."""
    annotation = get_type_hints(inspect.unwrap(command.callback), include_extras=True)[name]
    kind, *declared = get_args(annotation)
    rule = next(rule for known, rule in RULES.items() if known in (kind, *get_args(kind)))
    for info in declared:
        if isinstance(info, ParameterInfo) and info.min is not None:
            rule += f", at least {info.min:g}"
        if isinstance(info, ParameterInfo) and info.max is not None:
            rule += f", at most {info.max:g}"
    return rule
