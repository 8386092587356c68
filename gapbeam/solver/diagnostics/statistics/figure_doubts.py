"""Doubts on the figures of a random motion that no longer record takes away: impacts missed, and the bias of a scheme.

The scheme of a run in its step is at fault in two ways.

* Energy. What noise brings is lost by damping and by the scheme. With the loss D by damping and contact and that by the
  scheme, A, negative where it creates energy, the motion has D / (D + A) of the energy that the noise would give it:
  damping takes energy in proportion to what there is. Both are measured in the run itself.
* Contact. Steps that are long beside a contact change its force and duration. How far, is known for a rattling mass by
  the steps in its contacts (`noise_bias`); the median of the contacts of a face counts here.

Measured on rattling masses: with 1, 4, 16 and 32 steps of implicit-midpoint in a contact A / (D + A) is 32, 26, 12 and
6.7 %, and the mean square of the velocity 31, 26, 12 and 8.4 % low.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, Literal

from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.diagnostics.statistics.block_means import MOST_MISSED
from gapbeam.solver.integrators.noise_bias import NoiseBias, bias_at
from gapbeam.solver.record_table import SLIP_MODES

Doubt = Literal["not resolved", "biased"]

LEAST = 0.02  # of a figure: smaller biases, which are estimates, raise no doubt by themselves
COUNTED = ("impact_rate", "impact_duration", "impact_impulse", "approach_speed")
"""Figures of a face that depend on how many impacts were seen."""

WORK_RATE = "work_rate"
PARTS_OF_WORK = tuple(f"{mode}_{WORK_RATE}" for mode in SLIP_MODES)
"""Figures of a face that depend on when its impacts begin and end as well."""

OF_SHORT_CONTACTS = ("contact_share", "rms_force")
"""Figures of a face that hang on touches and partings which are short beside a step, as those of impacts do.

By how much they are off is not known where many of these are missed. Measured on a tube in three holes, a tenth of its
impacts missed: the contact share was 5 % low where a mass with as many steps in its contacts has 10 % too much; the
mean force and the work rate were off by 0.2 and 0.1 %.
"""

LEAST_STEPS = 6.0
"""In the time of an impact. Of a bounce with 6 steps, whose first half counts, 3 % is missing; with 4, 6 %."""


@dataclass(frozen=True)
class Doubts:
    """Doubts on the figures of a run.

    Attributes:
        missed: Part of the impacts that steps could not see, by face.
        energy: By how much the energy is off that the scheme leaves, relative; negative: too little.
        contacts: Steps in the median contact, by face.
        table: Bias of the scheme; empty: not measured.
        impact_steps: Steps in the time at the begin of a contact that counts as its impact.
    """

    missed: Mapping[str, float] = field(default_factory=dict)
    energy: float = 0.0
    contacts: Mapping[str, float] = field(default_factory=dict)
    table: tuple[NoiseBias, ...] = ()
    impact_steps: float = inf

    def bias(self, name: str) -> float | None:
        """Return about how far a figure is off by the scheme, relative; None: not known."""
        owner, _, figure = name.rpartition(".")
        kind, _, of = owner.partition(".")
        if kind == "probe":
            return 0.5 * self.energy if figure.endswith("rms") else None
        row = bias_at(self.table, self.contacts[of]) if of in self.contacts else None
        if row is not None and self.missed_of(name) > MOST_MISSED:
            return None
        if row is None:
            return self.energy if figure == "mean_force" or figure.endswith(WORK_RATE) else None
        return {
            "contact_share": row.contact_share,
            "mean_force": row.mean_force,
            "rms_force": 0.5 * row.mean_square_force,
            "impact_rate": row.impact_rate,
            WORK_RATE: row.mean_force + 0.5 * row.mean_square,
        }.get(figure)

    def missed_of(self, name: str) -> float:
        """Return the part of the impacts that a figure lacks; 0 for figures that do not hang on single impacts."""
        owner, _, figure = name.rpartition(".")
        kind, _, face = owner.partition(".")
        concerned = kind == "face" and figure in (*COUNTED, *PARTS_OF_WORK, *OF_SHORT_CONTACTS)
        return self.missed.get(face, 0.0) if concerned else 0.0

    @property
    def too_few_steps(self) -> str | None:
        """How many steps the time of an impact has, and needs, where it has too few for the parts of a work rate."""
        if self.impact_steps >= LEAST_STEPS:
            return None
        return f"has {self.impact_steps:.2g} steps, and needs {LEAST_STEPS:g}"

    def splits_too_early(self, name: str) -> bool:
        """Return whether a figure is a part of a work rate that steps are too long to separate from the others."""
        return self.too_few_steps is not None and name.rpartition(".")[2] in PARTS_OF_WORK

    def on(self, name: str, relative: float, least: float = LEAST) -> Doubt | None:
        """Return the doubt on a figure that is known within a relative error by chance; None: there is none.

        Args:
            name: Of the figure.
            relative: Half width of its interval over the figure.
            least: Smaller biases raise no doubt.
        """
        if self.missed_of(name) > MOST_MISSED or self.splits_too_early(name):
            return "not resolved"
        bias = self.bias(name)
        return "biased" if bias is not None and abs(bias) > max(relative, least) else None

    def words(self, name: str, doubt: Doubt) -> str:
        """Return a doubt on a figure in a sentence."""
        if doubt == "not resolved" and self.splits_too_early(name):
            return (
                f"the time that counts as impact {self.too_few_steps}: "
                "a longer wear.impact_time or a smaller time.step separates the parts; their sum is not concerned"
            )
        if doubt == "not resolved":
            return f"{self.missed_of(name):.1%} of the impacts of its face fell between two steps and were missed"
        bias = self.bias(name) or 0.0
        return f"the scheme in its step makes it about {abs(bias):.1%} too {'small' if bias < 0.0 else 'large'}"

    def describe(self, names: list[str]) -> dict[str, Any]:
        """Return what the summary reports, for figures of these names."""
        biases = {name: found for name in names if (found := self.bias(name)) is not None}
        counted = {} if self.impact_steps == inf else {"steps_in_impact": self.impact_steps}
        return {"energy": self.energy, "steps_in_contact": dict(self.contacts), **counted, "figures": biases}

    @classmethod
    def restored(cls, statistics: Mapping[str, Any]) -> Doubts:
        """Return the doubts on a part of a run, from the statistics in its summary; without the table of the scheme."""
        bias = statistics.get("scheme_bias") or {}
        missed, energy = statistics.get("missed_impacts") or {}, float(bias.get("energy") or 0.0)
        return cls(missed, energy, impact_steps=float(bias.get("steps_in_impact") or inf))


def energy_bias(ledger: Ledger) -> float:
    """Return by how much the energy of a motion under noise is off by the scheme, relative; 0 within round-off."""
    if abs(ledger.algorithmic) <= ledger.round_off:
        return 0.0
    brought = ledger.lost + ledger.algorithmic
    return ledger.lost / brought - 1.0 if brought > 0.0 else inf
