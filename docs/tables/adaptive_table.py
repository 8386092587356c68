"""Print what adaptive steps change: python3 docs/tables/adaptive_table.py, some seconds."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import pi, sqrt
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, Resolution, march
from gapbeam.solver.system.semi_discrete import Step
from tests.shared.toys import SCHEMES, ledger_of, start, stopped_oscillator

GRAVITY, HEIGHT, STIFFNESS, END = 9.81, 0.05, 1.0e6, 1.0  # m/s^2, m, N/m, s, with a mass of 1 kg
DURATION = pi / sqrt(STIFFNESS)
PEAK = GRAVITY + sqrt(GRAVITY**2 + 2.0 * STIFFNESS * GRAVITY * HEIGHT)  # N
COARSE, FINE, REFERENCE = 0.02, END / 3200, 1.0e-5  # s


def bounced(scheme: str, dt: float, adaptive: bool = False) -> list[Step]:
    """Let a mass fall 5 cm on a spring and bounce for a second."""
    system = stopped_oscillator(1.0, 0.0, HEIGHT, 0.0, lambda _: GRAVITY)
    gates = Gates()
    resolution = Resolution(DURATION, gates.impact_growth, gates.impact_loss) if adaptive else None
    operators = EffectiveOperators(system, SCHEMES[scheme])
    plan = March(
        system, kelvin_voigt(STIFFNESS), SCHEMES[scheme], operators, dt, round(END / dt), 8, resolution=resolution
    )
    return list(march(plan, start(system)))


def row(scheme: str, label: str, steps: Sequence[Step], place: float) -> str:
    """Return solves, error of the peak force, place at the end and energy created, in a row."""
    system = stopped_oscillator(1.0, 0.0, HEIGHT, 0.0, lambda _: GRAVITY)
    ledger = ledger_of(system, kelvin_voigt(STIFFNESS), start(system), list(steps))
    solves = len(steps) + sum(step.refinements for step in steps)
    peak = max(float(step.stage.pressure[0]) for step in steps) / PEAK - 1.0
    off = 1e3 * (float(steps[-1].new.u[0, 0]) - place)
    created = -ledger.algorithmic / (GRAVITY * HEIGHT)
    words = "0" if abs(created) < 1e-9 else f"{created:+.1%}"
    return f"| `{scheme}` | {label} | {solves} | {peak:+.1%} | {off:+.2f} mm | {words} |"


def table() -> str:
    """Return the table."""
    place = float(bounced("discrete-gradient", REFERENCE)[-1].new.u[0, 0])
    lines = ["| scheme | steps | solves | peak force | place after 1 s | energy created |", "|---|---|---|---|---|---|"]
    for scheme in ("discrete-gradient", "implicit-midpoint", "newmark"):
        lines.append(row(scheme, "20 ms", bounced(scheme, COARSE), place))
        lines.append(row(scheme, "20 ms, adaptive", bounced(scheme, COARSE, True), place))
        lines.append(row(scheme, "0.31 ms", bounced(scheme, FINE), place))
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())
