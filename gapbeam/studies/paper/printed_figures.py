"""The figures that the paper prints, as read from `printed.toml`."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

PAPER = (
    'Li, Jin, Han, Cao and He, "A spring dashpot model for dynamic analysis of beam-like structure with clearance", '
    "Journal of Vibroengineering (2013)"
)


@cache
def printed() -> dict[str, Any]:
    """Return the tables of `printed.toml` by name: beam, roots, plateau, adams, experiment; units as it says."""
    return tomllib.loads(files("gapbeam.studies.paper").joinpath("printed.toml").read_text(encoding="utf-8"))
