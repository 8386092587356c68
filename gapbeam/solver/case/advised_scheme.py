"""The time scheme that advice names."""

from __future__ import annotations

from gapbeam.solver.case.contact_table import Contact


def advised_scheme(contact: Contact) -> str:
    """Return the implicit scheme that fits a contact: it conserves energy where the contact has a potential."""
    return "implicit-midpoint" if contact.formulation.without_potential else "discrete-gradient"
