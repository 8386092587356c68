"""Contradictions of the restitution of the law kelvin-voigt."""

from __future__ import annotations

from collections.abc import Iterator

from solver.case_file.faults import Fault
from solver.case_tables.contact import Contact, KelvinVoigt, Penalty


def restitution_is_the_only_damping(contact: Contact) -> Iterator[Fault]:
    """The law kelvin-voigt takes a damping or a restitution, and no restitution where there is no damping."""
    law, formulation = contact.law, contact.formulation
    if not isinstance(law, KelvinVoigt) or law.restitution is None:
        return
    if not isinstance(formulation, Penalty):
        yield Fault(
            ("contact", "law", "restitution"),
            f"{law.restitution:g} with the formulation {formulation.type}",
            f"no restitution: the formulation {formulation.type} has no damping",
            'formulation = "penalty", or leave restitution out',
            (("contact", "formulation"),),
        )
    elif contact.damping > 0.0:
        yield Fault(
            ("contact", "law", "restitution"),
            f"{law.restitution:g} together with damping = {contact.damping:g}",
            "one of the two: the damping is computed from the restitution",
            "leave damping out",
            (("contact", "damping"),),
        )
