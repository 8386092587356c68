"""Contact episodes: are the impacts resolved by the time step?

An episode of a face lasts from the step in which it closes to the step in which it has opened. What happens
within a step or two is a matter of the scheme, not of the beam: the share of the impulse that short episodes
carry says how much of the contact force is so.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from gapbeam.solver.diagnostics.face_updates import RESOLVING_STEPS, after_contact
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.semi_discrete import ContactOperator


@dataclass
class Episodes:
    """Counts the contact episodes of every face.

    Attributes:
        contact: To distinguish the faces.
        count: Episodes that ended.
        short: Those of fewer than `RESOLVING_STEPS` steps.
        impulse: Contact force over time of all episodes, N s.
        short_impulse: That of the short ones, N s.
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
        """Return what the summary reports."""
        return {
            "episodes": self.count,
            "short_episodes": self.short,
            "short_means_fewer_steps_than": RESOLVING_STEPS,
            "share_of_impulse_in_short_episodes": self.unresolved_share,
        }
