"""Errors of the command line, of the click that typer stands on: a package of its own, or a part of typer (from 0.29).

An error of another click would pass typer by and end as a trace.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from click import BadParameter, ClickException, UsageError
else:
    BadParameter = typer.BadParameter
    UsageError = next(one for one in BadParameter.__mro__ if one.__name__ == "UsageError")
    ClickException = next(one for one in BadParameter.__mro__ if one.__name__ == "ClickException")

__all__ = ["BadParameter", "ClickException", "UsageError"]
