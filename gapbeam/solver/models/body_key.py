"""The key by which cases share a body: equal for cases that differ only in what is cheap to change."""

from __future__ import annotations

from gapbeam.solver.case.beam_motions import axial_restraint
from gapbeam.solver.case.case import Case, Contact, Damping, Friction, Gates, Output, Wear
from gapbeam.solver.case.model_choice import resolved_frequency
from gapbeam.solver.case.solution_tables import Time
from gapbeam.solver.supports.support_tables import without_play


def body_key(case: Case) -> Case:
    """Return a case with everything taken out that a body does not depend on; equal for cases that share a body.

    Clearance, law, stiffness and damping of the contact, structural damping, all of a load but its place and direction,
    time, analysis, gates and output are cheap to change, as long as the start stays in the bending plane or leaves it.
    The restraint along the beam is part of the body. Where it follows from loads and play, it is given in the key.
    """
    axial = axial_restraint(case).value
    return case.model_copy(
        update={
            "title": "",
            "damping": Damping(),
            "support": without_play(case.support),
            "contact": _contact(case),
            "wear": None if case.wear is None else Wear(),
            "load": tuple(load.without_cheap_keys() for load in case.load),
            "figure": (),
            "time": _time(case),
            "analysis": case.analysis.for_body,
            "model": case.model.model_copy(update={"reasons": ()}),
            "restraint": case.restraint.model_copy(update={"axial": axial}) if axial > 0.0 else case.restraint,
            "gates": Gates(),
            "output": Output(),
        }
    )


def _contact(case: Case) -> Contact:
    return case.contact.model_copy(
        update={
            "law": Contact.model_fields["law"].get_default(),
            "stiffness": "auto",
            "damping": 0.0,
            "tension": "clipped",
            "touch_depth": "auto",
            "friction": None if case.friction is None else Friction(coefficient=1.0),
        }
    )


def _time(case: Case) -> Time:
    """Return the scheme of explicit steps, and the frequency up to which the spans of a beam are resolved."""
    key = Time(end=1.0, step="auto", frequency=resolved_frequency(case))
    return key.model_copy(update={"scheme": case.time.scheme}) if case.time.scheme.explicit else key
