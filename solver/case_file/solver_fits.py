"""What of a case cannot do without a factor of the effective operator."""

from __future__ import annotations

from collections.abc import Iterator

from solver.case_file.faults import Fault, Key
from solver.case_tables.analysis import Analysis, Periodic
from solver.case_tables.contact import Contact, Penalty
from solver.case_tables.model import FullModel, ModelTable
from solver.case_tables.solver import SolverTable
from solver.case_tables.time import CentralDifference, MoreauJean, Time


def factor_needed(model: ModelTable, contact: Contact, time: Time, analysis: Analysis) -> tuple[Key, str] | None:
    """Return the key and the words for what needs a factor, or None: all but the full model need none to march."""
    if not isinstance(model, FullModel):
        return None
    formulation = contact.formulation
    if not isinstance(formulation, Penalty):
        return ("contact", "formulation"), f"the formulation {formulation.type}"
    if contact.rubs is not None:
        return ("contact", "friction"), "friction"
    if contact.mass == "redistributed":
        return ("contact", "mass"), 'contact.mass = "redistributed"'
    if isinstance(time.scheme, MoreauJean | CentralDifference):
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
