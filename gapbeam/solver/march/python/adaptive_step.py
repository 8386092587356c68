"""What an adaptive step must resolve, or be halved: impacts on a face, and the energy of the scheme."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.energy_ledger import created_in_step, round_off
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State

RESOLVING_SHARE = 0.1  # of the duration of an impact: the longest step during one


@dataclass(frozen=True)
class Resolution:
    """The limits of a step in contact.

    Attributes:
        contact_duration: Duration of an impact T_c, s.
        growth: Largest energy that the scheme may create in a step, relative to the energy T + V + Psi at its start.
        loss: Largest energy that it may take, likewise. Both are infinite for a scheme that conserves energy, which
            spares looking.
    """

    contact_duration: float
    growth: float = inf
    loss: float = inf

    @property
    def longest(self) -> float:
        """Longest step during an impact, s."""
        return RESOLVING_SHARE * self.contact_duration

    def watched(self, system: SemiDiscreteSystem, law: ContactLaw, new: State, old: State | None = None) -> State:
        """Return an accepted state with the times since when its faces are closed; at the start long since."""
        closed = _closed_faces(system.contact, law, new)
        since: Array = np.full(len(closed), -np.inf)
        if old is not None and old.closed_since is not None:
            since = np.where(old.closed_since < np.inf, old.closed_since, old.time)
        return replace(new, closed_since=np.where(closed, since, np.inf))

    def asks_for_half(self, system: SemiDiscreteSystem, law: ContactLaw, step: Step) -> bool:
        """Return whether a step is to be taken again in two halves.

        It is where it is longer than a tenth of an impact while a face opens, closes, or has closed less than the
        duration of an impact before; and where the scheme creates or takes more energy than the gates of an impact
        allow. Free flight and a beam at rest ask for neither.

        Args:
            system: The system.
            law: The contact law.
            step: The step as it would be accepted, from a state that was `watched`.

        Returns:
            The same on all ranks: depths are replicated, energies are summed alike.

        Collective.
        """
        since = step.old.closed_since
        assert since is not None
        before, after = since < np.inf, _closed_faces(system.contact, law, step.new)
        if not (np.any(before) or np.any(after)):
            return False
        if step.size > self.longest:
            young = before & (step.old.time - since < self.contact_duration)
            if np.any((before != after) | young):
                return True
        if self.growth == self.loss == inf:
            return False
        created, stored = created_in_step(system, law, step)
        if -self.loss * stored <= created <= self.growth * stored:
            return False
        return abs(created) > round_off(system, law, step.old)


def _closed_faces(contact: ContactOperator, law: ContactLaw, state: State) -> NDArray[np.bool_]:
    """Return which faces are closed, (faces,); multipliers press where hardly anything penetrates."""
    closed = (state.depth if law.augmented is None else state.pressure) > 0.0
    return np.bincount(contact.faces, weights=closed, minlength=len(contact.face_names)) > 0.0
