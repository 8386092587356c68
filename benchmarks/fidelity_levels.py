"""The fidelity levels of [model] on the solid beam of cases/li2013.toml, made so that its response is periodic."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.textbook import CASE

Level = tuple[Path, Sequence[str]]  # a case file and overrides

PERIODIC = (
    "contact.stiffness=1e12",
    "load.shaker.amplitude=150.0",
    "load.shaker.ramp=0.05",
    "damping.ratios=[0.05, 0.05]",
    "time.scheme=implicit-midpoint",
    "output.fields_interval=0.1",
)
SLICE = CASE.with_name("li2013-2d.toml")
REDUCED = ("model.type=reduced",)
LEVELS: dict[str, Level] = {
    "full": (CASE, ()),
    "reduced, all contact DOFs": (
        CASE,
        (*REDUCED, "model.contact=all", "model.points_across=all", "model.modes=30"),
    ),
    "reduced": (CASE, REDUCED),
    "2D, full": (SLICE, ()),
    "2D, reduced": (SLICE, REDUCED),
    "beam": (SLICE, ("model.type=beam",)),
}
