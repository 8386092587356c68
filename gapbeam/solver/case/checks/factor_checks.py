"""The parts of a case that need a factor of the effective operator."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.analysis_table import Analysis, Periodic
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.model_table import FullModel, ModelTable
from gapbeam.solver.case.solver_table import SolverTable
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.faults import Fault, Key


def factor_needed(model: ModelTable, contact: Contact, time: Time, analysis: Analysis) -> tuple[Key, str] | None:
    """Return the key and the words for what needs a factor, or None: all but the full model need none to march."""
    if not isinstance(model, FullModel):
        return None
    formulation = contact.formulation
    if not formulation.follows_the_law:
        return ("contact", "formulation"), f"the formulation {formulation.type}"
    if contact.rubs is not None:
        return ("contact", "friction"), "friction"
    if contact.mass == "redistributed":
        return ("contact", "mass"), 'contact.mass = "redistributed"'
    if time.scheme.needs_factor:
        return ("time", "scheme"), f"the scheme {time.scheme.type}"
    if isinstance(analysis, Periodic):
        return ("analysis", "type"), "a search for periodic responses"
    return None


def iterations_can_solve(
    model: ModelTable, contact: Contact, time: Time, analysis: Analysis, solver: SolverTable
) -> Iterator[Fault]:
    """Iterations replace a factor for penalty contact without friction, in implicit marches."""
    needed = factor_needed(model, contact, time, analysis) if solver.effective == "iterative" else None
    if needed is not None:
        yield Fault(
            ("solver", "effective"),
            f"iterative, with {needed[1]}",
            "auto or factor: iterations are for penalty contact without friction, marched by implicit schemes",
            'effective = "auto", or type = "reduced" in [model], which needs iterations only once',
            (needed[0],),
        )
