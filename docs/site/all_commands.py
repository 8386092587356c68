"""The page of all commands with all options, from the command line itself."""

from __future__ import annotations

import html
from typing import Any

import click
import typer

OPENING = """# Which options does each command have?

This page is made from the command line of gapbeam: what `gapbeam COMMAND --help` shows.
[Commands](command-line.md) says what their exit statuses mean.
"""


def cell(text: str | None) -> str:
    """Return a text of the help for a cell of a table: one line, in which nothing is HTML or ends the cell."""
    return html.escape(" ".join((text or "").split()), quote=False).replace("|", "\\|").replace("*", "\\*")


def option_row(option: Any) -> str:
    """Return the row of an option: its names, what it takes, what it does."""
    names = ", ".join(f"`{name}`" for name in [*option.opts, *option.secondary_opts])
    takes = "" if option.is_flag else f"`{option.metavar or ' / '.join(_values(option))}`"
    return f"| {names} | {takes} | {cell(option.help)} |"


def _values(option: Any) -> list[str]:
    """Return the choices of an option, or the type of its value; typer has new names for both from 0.29."""
    kind = getattr(option, "type", None) or option.type_descriptor
    return list(getattr(kind, "choices", None) or [getattr(kind, "name", "text").upper()])


def command_section(name: str, command: click.Command) -> str:
    """Return heading, usage, text and options of a command."""
    context = click.Context(command, info_name=f"gapbeam {name}")
    usage = " ".join(command.collect_usage_pieces(context))
    rows = [option_row(option) for option in command.params if option.param_type_name == "option"]
    arguments = [
        f"* `{argument.metavar or argument.name.upper()}`: {cell(argument.help)}"
        for argument in command.params
        if argument.param_type_name == "argument" and getattr(argument, "help", None)
    ]
    parts = [f"## {name}", f"    gapbeam {name} {usage}", cell(command.help)]
    parts += ["\n".join(arguments)] * bool(arguments)
    parts += ["\n".join(["| option | takes | does |", "|---|---|---|", *rows])] * bool(rows)
    return "\n\n".join(parts)


def commands_page() -> str:
    """Return the page."""
    from gapbeam.command_line import app

    group: Any = typer.main.get_command(app)
    shown = [(name, command) for name, command in group.commands.items() if not command.hidden]
    return "\n".join([OPENING, "\n\n".join(command_section(*one) for one in shown), ""])
