"""Shipped cases, shortened, with every model and every contact law among them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case

CASES = Path(__file__).parents[2] / "cases"


@dataclass(frozen=True)
class SimilarCase:
    """A shipped case that is run at several sizes.

    Attributes:
        name: Of its file in cases/.
        overrides: Keys that it replaces.
        end: Of the short run, s.
        to_the_last_bit: Whether all histories are the same at sizes that are powers of four: so wherever K of the law
            scales by a power of two.
        within: Otherwise allowed difference of histories, over their largest values.
        fast: Whether the fast tests have it.
    """

    name: str
    overrides: tuple[str, ...]
    end: float
    to_the_last_bit: bool = True
    within: float = 1.0e-9
    fast: bool = False

    def case(self, *, whole: bool = False) -> Case:
        """Return the case, shortened or as long as it is shipped."""
        short = () if whole else (f"time.end={self.end}", "output.errors=none")
        return read_case(CASES / f"{self.name}.toml", (*self.overrides, *short))


def _law(kind: str, **keys: float) -> str:
    return f'contact.law={{type="{kind}"' + "".join(f",{key}={value}" for key, value in keys.items()) + "}"


STIFF = "contact.stiffness=1e13"

SIMILAR_CASES = (
    SimilarCase("demo", (), 0.004),
    SimilarCase("stability", (_law("hunt-crossley", exponent=1.5, restitution=0.6), STIFF), 0.004, fast=True),
    SimilarCase("clamped", (), 0.004),
    SimilarCase("cantilever-stop", (), 0.01, fast=True),
    SimilarCase("boom", ('contact.law={type="piecewise-linear",depths=[1e-5],factors=[3.0]}',), 0.01),
    SimilarCase("sprung-stops", (_law("elastic-plastic", yield_pressure=1.0e6, hardening=0.1),), 0.02),
    SimilarCase("tube-holes", ('model={type="reduced",sections="rigid"}', "mesh.size=0.1"), 0.002),
    SimilarCase(
        "recorded",
        (_law("lankarani-nikravesh", exponent=1.5, restitution=0.6), STIFF, "contact.damping=0.0"),
        0.01,
    ),
    SimilarCase("random-vibration", (), 0.01, fast=True),
    SimilarCase("li2013-adams", (), 0.005, to_the_last_bit=False),
    SimilarCase(
        "li2013-adams", (_law("kelvin-voigt"), "contact.stiffness=1e7", "contact.damping=50"), 0.005, fast=True
    ),
)
