"""The group of all commands: a mistyped one is answered with the one that was probably meant."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from typer.core import TyperGroup

from gapbeam.postprocess.shell_command import shell_command
from gapbeam.process.terminal_text import harmless

if TYPE_CHECKING:
    from click import Command

SYNONYMS = {
    "simulate": "run", "solve": "run", "start": "run", "resume": "run", "init": "new", "create": "new",
    "template": "new", "validate": "check", "predict": "check", "draw": "view", "show": "view", "preview": "view",
    "film": "render", "movie": "render", "animate": "render", "picture": "render", "status": "watch",
    "progress": "watch", "monitor": "watch", "csv": "export", "convert": "export", "figures": "plot", "diff": "compare",
    "frequencies": "modes", "fit": "identify", "optimize": "identify", "completion": "--install-completion",
    "version": "--version", "help": "--help",
}  # fmt: skip
"""Names of our commands in other programs."""


class SuggestingGroup(TyperGroup):
    """Commands; instead of "No such command" with the nearest one."""

    def resolve_command(  # type: ignore[override]  # of click, or of the one that typer has from 0.29 on
        self, ctx: Any, args: list[str]
    ) -> tuple[str | None, Command | None, list[str]]:
        """Return the command of the first word.

        Raises:
            UsageError: There is none; with the command that was probably meant.
        """
        if args and not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            ctx.fail(f"No such command '{harmless(args[0])}'; {_hint(args[0], self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)


def _hint(word: str, commands: list[str]) -> str:
    from gapbeam.solver.wording.short_words import near

    if word.endswith(".toml"):
        return f"did you mean: {harmless(shell_command('gapbeam', 'run', Path(word)))}?"
    if Path(word).is_dir():
        return "put a command before the folder, such as plot or report"
    meant = SYNONYMS.get(word.lower()) or near(word, commands)
    return f"did you mean: gapbeam {meant}?" if meant else f"expected one of: {', '.join(commands)}"
