"""The scenes of the gallery: what `scenes.toml` says, their runs, and the forces of their short runs."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gapbeam

FOLDER = Path(__file__).parent
PROJECT = FOLDER.parents[1]


class Scene(NamedTuple):
    """One scene of the gallery; `scenes.toml` says what its fields are."""

    name: str
    picture: str
    text: str
    force: float
    tolerance: float
    changes: Mapping[str, Any] = {}
    short: Mapping[str, Any] = {}
    drawn: Mapping[str, Any] = {}
    minutes: float = 0.1

    @property
    def case(self) -> Path:
        """The case file."""
        return PROJECT / "cases" / f"{self.name}.toml"

    @property
    def file(self) -> Path:
        """The picture in the repository."""
        return FOLDER / "scenes" / f"{self.case.stem}.png"

    @property
    def command(self) -> str:
        """What a user types to run the scene as it is shown."""
        words = [f"--set {key}={str(value).lower()}" for key, value in self.changes.items()]
        return " ".join(["gapbeam run", f"cases/{self.name}.toml", *words])

    @property
    def quick(self) -> Mapping[str, Any]:
        """Keys that switch errors off where a case has them."""
        return {} if self.name.startswith("scenes/") else {"output.errors": "none"}

    def run(self, output: Path) -> Path:
        """Run the scene as it is shown and return its results folder."""
        outcome = gapbeam.run(self.case, {**self.changes, **self.quick}, output=output, overwrite=True)
        if outcome.exit_status:
            raise SystemExit(f"{self.name}: {outcome.message}")
        return output

    def measured(self, output: Path) -> float:
        """Return the largest contact force of the short run of this scene, in N."""
        changes = {**self.changes, **self.short, **self.quick}
        outcome = gapbeam.run(self.case, changes, output=output, overwrite=True)
        return max(map(float, outcome.summary["peak_contact_force"].values()))


def scenes(path: Path = FOLDER / "scenes.toml") -> list[Scene]:
    """Return the scenes in the order of the gallery."""
    return [Scene(**table) for table in tomllib.loads(path.read_text(encoding="utf-8"))["scene"]]
