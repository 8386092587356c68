"""Print what friction costs and changes: python3 docs/tables/friction_table.py, a minute."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import gapbeam
from docs.tables.narrow_tables import narrow

CASE = Path(__file__).parents[2] / "cases" / "demo.toml"
MU = 0.2
SETTINGS = {"time.end": 0.15, "load.shaker.ramp": 0.02, "output.fields_interval": 0.15}
HEAD = "| mu | v0 | ms per step | iterations | peak friction, N | loss, mJ | of the energy exchanged | displacement |"


def run(folder: Path, mu: float | None, slip_velocity: float | None = None) -> tuple[dict[str, Any], np.ndarray]:
    """Return the summary of a run and the bending displacement of the tip."""
    friction = {} if mu is None else {"contact.friction.coefficient": mu}
    if slip_velocity is not None:
        friction["contact.friction.slip_velocity"] = slip_velocity
    outcome = gapbeam.run(CASE, SETTINGS | friction, folder, overwrite=True)
    if outcome.exit_status != 0:
        raise RuntimeError(outcome.message)
    history = gapbeam.open_results(folder).history
    return outcome.summary, history["displacement"].sel(probe="tip").values[:, -1]


def _row(summary: dict[str, Any], tip: np.ndarray, reference: np.ndarray, mu: float, words: str) -> str:
    energy, cost, convergence = summary["energy"], summary["wall_time"], summary["convergence"]
    force = max(summary["friction"]["peak_force"].values()) if "friction" in summary else 0.0
    loss = energy["friction_dissipation"]
    apart = np.abs(tip - reference).max() / np.ptp(reference)
    return (
        f"| {mu:g} | {words} | {1e3 * cost['advance']:.2f} | {convergence['iterations_mean']:.1f} | {force:.2f} "
        f"| {1e3 * loss:.4f} | {loss / energy['exchanged']:.3%} | {apart:.1e} |"
    )


def table() -> str:
    """Return the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        plain, free = run(folder, None)
        auto, reference = run(folder, MU)
        chosen = auto["friction"]["slip_velocity"]
        rows = [
            _row(plain, free, reference, 0.0, "none"),
            _row(auto, reference, reference, MU, f"auto, {chosen:.2g} m/s"),
        ]
        for words, share in (("half", 0.5), ("double", 2.0), ("100 times", 100.0)):
            rows.append(_row(*run(folder, MU, share * chosen), reference, MU, words))
        rows += [_row(*run(folder, mu), reference, mu, "auto") for mu in (0.05, 1.0, 5.0)]
    return narrow("\n".join([HEAD, "|---|" + "---|" * 7, *rows]) + "\n", keys=2)


if __name__ == "__main__":
    print(table())
