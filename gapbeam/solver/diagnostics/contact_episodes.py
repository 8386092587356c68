"""Contact episodes, which show whether the time step resolves the impacts.

An episode of a face lasts from the step in which it closes to the step in which it has opened. What happens
within a step or two is a matter of the scheme, not of the beam: the share of the impulse that short episodes
carry says how much of the contact force is so.

Loops measure, and these functions count impacts, episodes and peaks after each step. They take and return plain
numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.diagnostics.energy_ledger import relative_growth
from gapbeam.solver.jit import shared
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.semi_discrete import ContactOperator

UNKNOWN, CLOSED, OPEN = -1, 0, 1
RESOLVING_STEPS = 10  # steps that an episode should have


class Watched(NamedTuple):
    """A face as the gates see it.

    Attributes:
        face: UNKNOWN, CLOSED or OPEN when last seen.
        created: Energy created when the impact that has not ended began, J; NaN: there is none.
        energy: Kinetic and strain energy then, J.
    """

    face: int
    created: float
    energy: float


class Peak(NamedTuple):
    """Contact of a face since t = 0.

    Attributes:
        impulse: Contact force over time, N s.
        square: Its square over time, N^2 s.
        force: Largest contact force, N.
        friction: Largest friction force, N.
        depth: Largest penetration, m.
    """

    impulse: float
    square: float
    force: float
    friction: float
    depth: float


class FaceTouches(NamedTuple):
    """Time in contact of a face, s, and how often it closed, since t = 0; 1 where it is closed now, else 0."""

    time: float
    closings: float
    closed: float


@shared
def after_look(
    before: Watched, closed: bool, created: float, energy: float, round_off: float
) -> tuple[Watched, bool, float]:
    """Return a face after a step, whether an impact ended with it, and the relative growth of energy in that impact.

    Args:
        before: The face before.
        closed: Whether anything presses it now.
        created: Energy created since t = 0, J.
        energy: Kinetic and strain energy, J.
        round_off: Energy that the balance cannot resolve, J.
    """
    now = CLOSED if closed else OPEN
    if before.face == OPEN and now == CLOSED:
        return Watched(now, created, energy), False, 0.0
    if before.face == CLOSED and now == OPEN and not np.isnan(before.created):
        growth = relative_growth(created - before.created, before.energy, round_off)
        return Watched(now, np.nan, np.nan), True, growth
    return Watched(now, before.created, before.energy), False, 0.0


@shared
def breaks_gates(growth: float, most_growth: float, most_loss: float) -> bool:
    """Return whether an impact with this relative growth of energy lies outside the gates."""
    return growth > most_growth or -growth > most_loss


@shared
def after_contact(steps: int, impulse: float, pressed: bool, added: float) -> tuple[int, float, bool, bool]:
    """Return the steps and impulse of the episode of a face after a step, whether it ended, and whether it was short.

    Args:
        steps: Steps of the episode before; 0: there is none.
        impulse: Its impulse, N s.
        pressed: Whether anything presses the face in the balance of the step.
        added: Impulse of the step, N s.
    """
    if pressed:
        return steps + 1, impulse + added, False, False
    return 0, 0.0, steps > 0, 0 < steps < RESOLVING_STEPS


@shared
def after_touch(before: FaceTouches, dt: float, closed: bool) -> FaceTouches:
    """Return the contact times of a face after a step.

    Args:
        before: The times before.
        dt: Size of the step, s.
        closed: Whether the face is in contact at its end.
    """
    if not closed:
        return FaceTouches(before.time, before.closings, 0.0)
    return FaceTouches(before.time + dt, before.closings + 1.0 - before.closed, 1.0)


@shared
def after_forces(before: Peak, dt: float, force: float, friction: float, depth: float) -> Peak:
    """Return the peaks of a face after a step with these forces, N, which ends at this penetration, m."""
    return Peak(
        before.impulse + dt * force,
        before.square + dt * force * force,
        max(before.force, force),
        max(before.friction, friction),
        max(before.depth, depth),
    )


@dataclass
class Episodes:
    """Counts the contact episodes of every face.

    Attributes:
        contact: To distinguish the faces.
        count: Episodes that ended.
        short: Those of fewer than `RESOLVING_STEPS` steps.
        impulse: Contact force over time of all episodes, N s.
        short_impulse: Contact force over time of the short ones, N s.
        running: Steps and impulse of the episode of each closed face.
    """

    contact: ContactOperator
    count: int = 0
    short: int = 0
    impulse: float = 0.0
    short_impulse: float = 0.0
    running: dict[int, tuple[int, float]] = field(default_factory=dict)

    def watch(self, step: Step) -> None:
        """Take in an accepted step."""
        pressure, weights = step.stage.pressure, self.contact.weights
        for face, mine in enumerate(self.contact.points_of_faces):
            pressed = bool((pressure[mine] > 0.0).any())
            added = step.size * float(weights[mine] @ pressure[mine]) if pressed else 0.0
            steps, impulse = self.running.pop(face, (0, 0.0))
            now, running, ended, short = after_contact(steps, impulse, pressed, added)
            if now:
                self.running[face] = (now, running)
            self.impulse += added
            self.count += ended
            if short:
                self.short += 1
                self.short_impulse += impulse

    @property
    def unresolved_share(self) -> float:
        """Share of the impulse in short episodes."""
        return self.short_impulse / self.impulse if self.impulse > 0.0 else 0.0

    def figures(self) -> dict[str, Any]:
        """Return the figures for the summary."""
        return {
            "episodes": self.count,
            "short_episodes": self.short,
            "short_means_fewer_steps_than": RESOLVING_STEPS,
            "share_of_impulse_in_short_episodes": self.unresolved_share,
        }
