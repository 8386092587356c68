"""Gates on the energy ledger: a run that creates energy does not pass.

* Each impact (a face closing and opening again): the algorithmic loss or growth during it, relative to the
  kinetic and strain energy at its start, shall lie within the gates. Violations are counted and warned about.
* The whole run: created energy above `total_growth` of the energy exchanged ends the run; above `impact_growth`
  at the end, the run has failed; so it has where the scheme itself took more than `total_loss`, in impacts or away from
  them.

Source: the default limits are those that CalculiX documents for contact.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.diagnostics.contact_episodes import CLOSED, OPEN, UNKNOWN, Watched, after_look, breaks_gates
from gapbeam.solver.diagnostics.energy_ledger import Ledger, relative_growth
from gapbeam.solver.messages.errors import EnergyCreated, EnergyLost, NotFinite
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator, Step

SAFE_WITHOUT_POTENTIAL = "implicit-midpoint"  # a scheme that only loses energy at impacts


def remedy_for(case: Case) -> str:
    """Return the remedy for a case whose scheme creates energy, in a sentence: never the scheme that it has."""
    ways = list[str]()
    scheme, formulation = case.time.scheme, case.contact.formulation
    if formulation.without_potential and scheme.type != SAFE_WITHOUT_POTENTIAL:
        ways.append(f"the scheme {SAFE_WITHOUT_POTENTIAL}")
    elif not formulation.without_potential and not scheme.conserves_energy:
        ways.append("the scheme discrete-gradient")
    ways.append("a smaller time.step")
    if formulation.follows_the_law:
        ways.append(f"a softer {case.layout.stiffness_keys}")
    return f"Try {', '.join(ways[:-1])} or {ways[-1]}" if len(ways) > 1 else f"Try {ways[0]}"


@dataclass
class EnergyGates:
    """Watches a ledger from step to step.

    Attributes:
        limits: The gates of the case.
        contact: Contact operator, which distinguishes the faces; None: `look` is called with each.
        impacts: Impacts that ended so far.
        largest_growth: Largest relative algorithmic growth in one impact.
        largest_loss: Largest relative algorithmic loss in one impact.
        violations: Impacts outside the gates.
        open_faces: Whether each face was open when last seen.
        entries: Energy created, and kinetic and strain energy, when faces closed whose impact has not ended, J.
        remedy: Advice where energy is created, in a sentence.
    """

    limits: Gates
    contact: ContactOperator | None
    impacts: int = 0
    largest_growth: float = 0.0
    largest_loss: float = 0.0
    violations: int = 0
    open_faces: dict[int, bool] = field(default_factory=dict)
    entries: dict[int, tuple[float, float]] = field(default_factory=dict)
    remedy: str = "Try a smaller time.step"

    def check(self, step: Step, ledger: Ledger) -> None:
        """Pass a step, or raise.

        Raises:
            NotFinite: The energy is not a number.
            EnergyCreated: More energy was created than `total_growth` allows, unless the case accepts it.
        """
        finite = bool(np.isfinite(ledger.total) and np.isfinite(step.new.pressure).all())
        if finite:
            self._watch_impacts(step.new.pressure, ledger)
        self.let_pass(step.new.time, finite, ledger)

    def let_pass(self, time: float, finite: bool, ledger: Ledger) -> None:
        """Pass a step that ended at a time, or raise as `check` does.

        Args:
            time: End of the step, s.
            finite: Whether energy and contact pressure are.
            ledger: The ledger after it.
        """
        if not finite:
            raise NotFinite(f"at t = {time:.6g} s energy or contact pressure is not finite. {self.remedy}")
        growth = self.growth(ledger)
        if growth > self.limits.total_growth and not self.limits.accept_energy_growth:
            raise EnergyCreated(
                f"at t = {time:.6g} s the scheme has created {ledger.created:.3g} J, {growth:.1%} of the "
                f"energy exchanged (allowed: {self.limits.total_growth:.1%}); the results are not to be trusted. "
                f"{self.remedy}; gates.accept_energy_growth = true continues anyway"
            )

    def growth(self, ledger: Ledger) -> float:
        """Return created energy relative to the energy exchanged; 0 where round-off hides it."""
        return relative_growth(ledger.created, ledger.exchanged, ledger.round_off)

    def failed(self, ledger: Ledger) -> bool:
        """Return whether the whole run has created energy beyond the gate of an impact."""
        return self.growth(ledger) > self.limits.impact_growth

    def loss(self, ledger: Ledger) -> float:
        """Return the algorithmic loss of the whole run over the energy exchanged; 0 where round-off hides it."""
        return max(relative_growth(ledger.algorithmic, ledger.exchanged, ledger.round_off), 0.0)

    def judge(self, scheme: str, ledger: Ledger) -> None:
        """Pass a march that reached its end, or raise.

        Args:
            scheme: Its name.
            ledger: Ledger at the end.

        Raises:
            EnergyCreated: More energy was created over the run than the gate of an impact allows.
        """
        if self.failed(ledger) and not self.limits.accept_energy_growth:
            raise EnergyCreated(
                f"the scheme {scheme} created {ledger.created:.3g} J, "
                f"{self.growth(ledger):.2%} of the energy exchanged (allowed: {self.limits.impact_growth:.2%}): "
                f"the results are not to be trusted. {self.remedy}; gates.accept_energy_growth = true accepts it"
            )

    def judge_loss(self, scheme: str, ledger: Ledger, otherwise: str = "") -> None:
        """Pass a march whose scheme took little energy, or raise.

        Args:
            scheme: Its name.
            ledger: Ledger at the end.
            otherwise: Advice besides a smaller step.

        Raises:
            EnergyLost: The scheme took more of the energy than the gates allow.
        """
        share = self.loss(ledger)
        if share > self.limits.total_loss and not self.limits.accept_energy_loss:
            raise EnergyLost(
                f"the scheme {scheme} took {ledger.algorithmic:.3g} J, {share:.1%} of the energy "
                f"exchanged (allowed: {self.limits.total_loss:.1%}); damping and contact took {ledger.lost:.3g} J: "
                f"the results are not to be trusted. Try a smaller time.step{otherwise}; "
                "gates.total_loss allows more, gates.accept_energy_loss = true accepts it"
            )

    def remarks(self, ledger: Ledger, step: str) -> Iterator[str]:
        """Yield the impacts outside of the gates, and the growth that was accepted, with the name of the step."""
        if self.violations:
            yield (
                f"{self.violations} of {self.impacts} impacts changed the energy by more than the gates allow (largest "
                f"growth {self.largest_growth:.2%}, largest loss {self.largest_loss:.2%}): try a smaller {step}"
            )
        if self.failed(ledger) and self.limits.accept_energy_growth:
            yield f"energy growth of {self.growth(ledger):.2%} accepted by gates.accept_energy_growth"

    def watched(self, face: int) -> Watched:
        """Return a face as it was last seen."""
        seen = UNKNOWN if face not in self.open_faces else OPEN if self.open_faces[face] else CLOSED
        return Watched(seen, *self.entries.get(face, (np.nan, np.nan)))

    def keep(self, face: int, seen: Watched) -> None:
        """Keep a face as it is seen now."""
        if seen.face != UNKNOWN:
            self.open_faces[face] = seen.face == OPEN
        if not np.isnan(seen.created):
            self.entries[face] = (seen.created, seen.energy)
        else:
            self.entries.pop(face, None)

    def _watch_impacts(self, pressure: Array, ledger: Ledger) -> None:
        created, energy = ledger.created, ledger.kinetic + ledger.strain
        assert self.contact is not None
        for face, closed in enumerate(self.contact.faces_with(pressure > 0.0)):
            self.look(face, bool(closed), created, energy, ledger.round_off)

    def look(self, face: int, closed: bool, created: float, energy: float, round_off: float) -> None:
        """Take in a face after a step; see `after_look`."""
        seen, ended, growth = after_look(self.watched(face), closed, created, energy, round_off)
        self.keep(face, seen)
        if ended:
            self.impacts += 1
            self.largest_growth = max(self.largest_growth, growth)
            self.largest_loss = max(self.largest_loss, -growth)
            self.violations += breaks_gates(growth, self.limits.impact_growth, self.limits.impact_loss)


def describe_energy(ledger: Ledger, gates: EnergyGates) -> dict[str, Any]:
    """Return the ledger at the end and the findings of the gates."""
    exchanged = ledger.exchanged
    return {
        "kinetic": ledger.kinetic,
        "strain": ledger.strain,
        "contact": ledger.contact,
        "load_work": [float(x) for x in ledger.load_work],
        "structural_dissipation": ledger.structural,
        "contact_dissipation": ledger.contact_loss,
        "friction_dissipation": ledger.friction_loss,
        "algorithmic_dissipation": ledger.algorithmic,
        "residual": ledger.residual,
        "exchanged": exchanged,
        "round_off": ledger.round_off,
        "absolute_work": ledger.absolute_work,
        "relative_residual": ledger.residual / exchanged if exchanged > 0.0 else 0.0,
        "created": ledger.created,
        "relative_growth": gates.growth(ledger),
    }


SEEN = ("impacts", "violations", "largest_growth", "largest_loss")


def describe_gates(gates: EnergyGates) -> dict[str, Any]:
    """Return the findings of the impact gates."""
    return {name: getattr(gates, name) for name in SEEN} | {"limits": gates.limits.model_dump()}
