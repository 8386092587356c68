"""Which cases share a body: those that differ in what is cheap to change only."""

from __future__ import annotations

from solver.case import Case, Damping, Exciter, Gates, Gravity, OfSupport, Output
from solver.case import Load as CaseLoad
from solver.case_tables.analysis import Transient
from solver.case_tables.contact import Contact, Friction, KelvinVoigt
from solver.case_tables.recorded import Recorded
from solver.case_tables.time import CentralDifference, Time


def body_key(case: Case) -> Case:
    """Return a case with everything taken out that a body does not depend on; equal for cases that share a body.

    Clearance, law, stiffness and damping of the contact, structural damping, amplitudes, frequencies, phases and ramps
    of the loads, records and how they are read, mass, suspension and preload of exciters, time, analysis, gates and
    output are cheap to change.
    """
    return case.model_copy(
        update={
            "title": "",
            "damping": Damping(),
            "support": case.support.model_copy(update={"clearance": 0.0}),
            "contact": _contact(case.contact),
            "load": tuple(_load(load) for load in case.load),
            "time": _time(case.time),
            "analysis": Transient(),
            "gates": Gates(),
            "output": Output(),
        }
    )


def _contact(contact: Contact) -> Contact:
    return contact.model_copy(
        update={
            "law": KelvinVoigt(),
            "stiffness": "auto",
            "damping": 0.0,
            "tension": "clipped",
            "touch_depth": "auto",
            "friction": None if contact.rubs is None else Friction(coefficient=1.0),
        }
    )


def _load(load: CaseLoad) -> CaseLoad:
    if isinstance(load, Gravity):
        return load.model_copy(update={"acceleration": 0.0})
    cheap: dict[str, object]
    if isinstance(load, Recorded):
        fields = Recorded.model_fields.keys() - {"name", "direction"}
        cheap = {name: Recorded.model_fields[name].get_default() for name in fields - {"file"}} | {"file": ""}
    else:
        cheap = {"amplitude": 0.0, "frequency": 1.0, "phase": 0.0, "ramp": 0.0}
    if isinstance(load, OfSupport):
        cheap["quantity"] = "acceleration"
    if isinstance(load, Exciter):
        cheap |= {"mass": 0.0, "stiffness": 0.0, "damping": 0.0, "preload": 0.0}
    return load.model_copy(update=cheap)


def _time(time: Time) -> Time:
    explicit = isinstance(time.scheme, CentralDifference)
    return Time(end=1.0, step="auto", scheme=time.scheme) if explicit else Time(end=1.0, step="auto")
