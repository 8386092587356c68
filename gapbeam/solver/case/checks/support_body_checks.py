"""Contradictions between flexible supports and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.analysis_table import Analysis, Transient
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.model_table import FullModel, ModelTable
from gapbeam.solver.faults import Fault
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.supports.layout import Layout, keyed
from gapbeam.solver.supports.support_tables import AnySupports


def bodies_need_few_dofs(support: AnySupports, model: ModelTable) -> Iterator[Fault]:
    """Motions of supports are unknowns in addition to a basis, or to beam elements."""
    if not isinstance(model, FullModel):
        return
    for key, one in keyed(support):
        if one.body is not None:
            yield Fault(
                (*key, "body"),
                f"a body of {one.body.mass:g} kg, with the model full, whose unknowns are those of the mesh alone",
                "a reduced, beam or rigid model, which takes the motion of a support among its unknowns",
                'type = "reduced" in [model]',
                (("model", "type"),),
            )


def bodies_start_in_a_run(support: AnySupports, analysis: Analysis) -> Iterator[Fault]:
    """A body starts by itself in a march, and at its own rest where it does not start at the seat."""
    for key, one in keyed(support):
        if one.body is None or not one.body.moved:
            continue
        name = "displacement" if one.body.displacement != 0.0 else "velocity"
        if not isinstance(analysis, Transient):
            yield Fault(
                (*key, "body", name),
                f"{getattr(one.body, name)}, in the search for a periodic response",
                "no start: a periodic response has none",
                f"leave {name} out",
                (("analysis", "type"),),
            )
        elif one.body.displacement == "rest" and (analysis.state is not None or analysis.start == "seat"):
            yield Fault(
                (*key, "body", "displacement"),
                '"rest", in a run that starts ' + ("from a state" if analysis.state is not None else "at the seat"),
                "a number: beam and body start where they stand together",
                'start = "undeformed" in [analysis]',
                (("analysis", "state" if analysis.state is not None else "start"),),
            )


def bodies_stand_on_the_frame(support: AnySupports, load: Loads) -> Iterator[Fault]:
    """A flexible support moves by its contact forces, and not as a function of time."""
    layout = Layout.of(support)
    for number, entry in load.items():
        place = entry.place
        if not isinstance(place, SupportWalls) or place.opens:
            continue
        moved = moved_by(place, layout)
        if moved is not None and moved.body is not None:
            yield Fault(
                ("load", number, "type"),
                f"{entry.type} of the support {moved.name}, which has a body",
                "a support without body: the motion of this one follows from its mass, spring and damper",
                "base_motion moves the feet of all springs alike; leave body out for a prescribed motion",
                (("support",),),
            )
