"""An assumption of the equations: its limits, and how close a run came to them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.errors import AssumptionBroken
from gapbeam.solver.system.operators import Array

HOLDS, WARNING, FAILURE = "holds", "warning", "failure"


@dataclass(frozen=True)
class Assumption:
    """Assumption of the equations, with its limits.

    Attributes:
        name: In a few words.
        quantity: The watched quantity.
        unit: Its SI unit, "1" where there is none.
        limit: Beyond it, the run warns.
        failure: Beyond it, the run ends with status 4; None: it only warns.
        meaning: Consequence where the limit is passed, and advice.
    """

    name: str
    quantity: str
    unit: str
    limit: float
    failure: float | None
    meaning: str

    def limited_by(self, gates: Gates) -> Assumption:
        """Return the assumption with the limits that a case gives it; a failure is never below a warning."""
        warning, failure = gates.warnings.of(self.name), gates.failures.of(self.name)
        limit = self.limit if warning is None else warning
        if failure is None:
            failure = None if self.failure is None else max(self.failure, limit)
        else:
            limit = min(limit, failure)
        return replace(self, limit=limit, failure=failure if failure is None or isfinite(failure) else None)


@dataclass(frozen=True)
class Finding:
    """Distance of a run from the limit of an assumption.

    Attributes:
        assumption: The assumption.
        closest: The largest value of its quantity.
        time: When, s; None: it is not of one instant.
        place: Where, (3,), m; None: it is not of one point.
        estimate: Relative error of figures by it; None: not known.
        detail: Details of the value, in words.
        of: The figure that the estimate belongs to.
    """

    assumption: Assumption
    closest: float
    time: float | None = None
    place: Array | None = None
    estimate: float | None = None
    detail: str = ""
    of: str = "figures"

    @property
    def verdict(self) -> str:
        """Verdict: the assumption holds, or one of its limits is passed; a value that is not a number fails."""
        worst = self.assumption.failure
        if worst is not None and not self.closest <= worst:
            return FAILURE
        return HOLDS if self.closest <= self.assumption.limit else WARNING

    @property
    def words(self) -> str:
        """Distance from the limit, in one sentence."""
        one = self.assumption
        unit = "" if one.unit == "1" else f" {one.unit}"
        where = "" if self.time is None else f" at t = {self.time:.6g} s"
        if self.place is not None:
            where += f", point ({', '.join(f'{x:.4g}' for x in self.place)}) m"
        limit = one.failure if self.verdict == FAILURE else one.limit
        error = "" if self.estimate is None else f"; {self.of} are off by about {100.0 * self.estimate:.2g} %"
        detail = f" ({self.detail})" if self.detail else ""
        return f"{one.name}: {one.quantity} {self.closest:.3g}{unit}{where}{detail}, limit {limit:g}{unit}{error}"

    @property
    def share(self) -> float:
        """Largest value over the limit: 1 at the limit."""
        return self.closest / self.assumption.limit  # 0 where there is none

    @property
    def remark(self) -> str:
        """Warning for the user where the limit is passed."""
        return f"{self.words}: {self.assumption.meaning}"

    def as_data(self) -> dict[str, Any]:
        """Return the finding for summary.json."""
        one = self.assumption
        return {
            "name": one.name,
            "quantity": one.quantity,
            "unit": one.unit,
            "closest": self.closest,
            "limit": one.limit,
            "failure_limit": one.failure,
            "share_of_limit": self.share,
            "time": self.time,
            "place": None if self.place is None else [float(x) for x in self.place],
            "error_estimate": self.estimate,
            "detail": self.detail,
            "verdict": self.verdict,
            "meaning": one.meaning,
        }


def limited(findings: Iterable[Finding], gates: Gates) -> list[Finding]:
    """Return findings with the limits that a case gives their assumptions."""
    return [replace(finding, assumption=finding.assumption.limited_by(gates)) for finding in findings]


def in_one_line(findings: Sequence[Finding]) -> str:
    """Return the number of assumptions that hold, and the one closest to its limit."""
    holding = [finding for finding in findings if finding.verdict == HOLDS]
    nearest = max(holding, key=lambda finding: finding.share, default=None)
    closest = "" if nearest is None else f"; closest to its limit: {nearest.words}"
    return f"{len(holding)} of {len(findings)} assumptions hold{closest}"


def let_pass(findings: Sequence[Finding]) -> None:
    """Pass findings none of which has failed, or raise.

    Raises:
        AssumptionBroken: A limit beyond which the figures mean nothing is passed.
    """
    failed = [finding for finding in findings if finding.verdict == FAILURE]
    if failed:
        raise AssumptionBroken(
            "an assumption behind the figures does not hold, the results are not to be trusted: "
            + "; ".join(finding.remark for finding in failed)
            + f". gates.failures.{failed[0].assumption.name.replace(' ', '_')} sets another limit"
        )
