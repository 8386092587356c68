"""The group of all commands: a mistyped one is answered with the one that was probably meant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from typer.core import TyperGroup

from gapbeam.postprocess.shell_command import shell_command
from gapbeam.process.terminal_text import harmless

SYNONYMS = {
    "simulate": "run", "solve": "run", "start": "run", "resume": "run", "init": "new", "create": "new",
    "template": "new", "validate": "check", "predict": "check", "draw": "view", "show": "view", "preview": "view",
    "film": "render", "movie": "render", "animate": "render", "picture": "render", "status": "watch",
    "progress": "watch", "monitor": "watch", "csv": "export", "convert": "export", "figures": "plot", "diff": "compare",
    "frequencies": "modes", "fit": "identify", "completion": "--install-completion",
    "fmi": "fmu", "version": "--version", "help": "--help",
}  # fmt: skip
"""Names of our commands in other programs."""


EXAMPLES = {
    "run": "gapbeam run case.toml --set support.clearance=0.2e-3 --output results/wide",
    "check": "gapbeam check case.toml",
    "schema": "gapbeam schema > case.schema.json",
    "new": "gapbeam new my-beam.toml --template demo",
    "view": "gapbeam view case.toml",
    "watch": "gapbeam watch results/case",
    "plot": "gapbeam plot results/case",
    "render": "gapbeam render results/case --frames 50",
    "export": "gapbeam export results/case",
    "report": "gapbeam report results/case",
    "fmu": "gapbeam fmu case.toml --input shaker",
    "compile": "gapbeam compile",
    "sweep": "gapbeam sweep case.toml support.clearance=0.1e-3:0.4e-3:7 --workers 2",
    "stability": "gapbeam stability case.toml",
    "tradeoff": "gapbeam tradeoff case.toml",
    "modes": "gapbeam modes case.toml --count 6",
    "identify": "gapbeam identify study.toml",
    "compare": "gapbeam compare results/a results/b",
    "life": "gapbeam life case.toml --set wear.depth_limit=0.5e-3",
    "atlas": "gapbeam atlas case.toml",
    "uncertain": "gapbeam uncertain study.toml",
    "library": "gapbeam library study.toml --output results/library",
    "optimize": "gapbeam optimize study.toml",
    "estimate": "gapbeam estimate results/library recording.csv --unit mm/s",
}
"""A line to type, for the end of the help of each command."""


class SuggestingGroup(TyperGroup):
    """Commands; instead of "No such command" with the nearest one. Help ends with an example."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # of click, or of the one that typer has from 0.29 on
        """Return a command, with its example; None: there is none."""
        found = super().get_command(ctx, cmd_name)
        if found is not None and cmd_name in EXAMPLES:
            found.epilog = f"Example: {EXAMPLES[cmd_name]}"
        return found

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the command of the first word.

        Raises:
            UsageError: The word is no command; the message has the command that was probably meant.
        """
        if args and not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            ctx.fail(f"No such command '{harmless(args[0])}'; {_hint(args[0], self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)


def _hint(word: str, commands: list[str]) -> str:
    from gapbeam.solver.messages.wording import near

    if word.endswith(".toml"):
        return f"did you mean: {harmless(shell_command('gapbeam', 'run', Path(word)))}?"
    if Path(word).is_dir():
        return "put a command before the folder, such as plot or report"
    meant = SYNONYMS.get(word.lower()) or near(word, commands)
    return f"did you mean: gapbeam {meant}?" if meant else f"expected one of: {', '.join(commands)}"
