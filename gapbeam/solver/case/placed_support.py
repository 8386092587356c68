"""The table of a [[support]] with the contact law that it may name, and which law acts at a support."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Discriminator, Field, Tag

from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.law_choice import Law
from gapbeam.solver.supports.support_tables import BaseAndGland, OneOfSeveral, OneSupport
from gapbeam.solver.table import FORMS, named, placed_along


class SupportWithLaw(OneOfSeveral):
    """A [[support]] without its place, with a contact law of its own."""

    law: Annotated[Law, BeforeValidator(named)] | None = Field(
        default=None,
        description="contact law: a name, or a table with the type and its keys; default that of [contact]",
    )

    def without_play(self) -> OneOfSeveral:
        """Return the support with everything taken out that changes its gaps, its contact law and its body alone."""
        return super().without_play().model_copy(update={"law": None})


PlacedSupport = placed_along(
    SupportWithLaw,
    "PlacedSupport",
    "the support",
    (0.2, 0.22),
    "A support along the beam, from x = from to x = to; the beam touches the faces of its region.",
)


def _form(value: object) -> str:
    """Return whether supports are given as one table or as an array of tables."""
    return FORMS[isinstance(value, list | tuple)]


SupportTables = Annotated[
    Annotated[BaseAndGland, Tag(FORMS[0])] | Annotated[tuple[PlacedSupport, ...], Field(min_length=1), Tag(FORMS[1])],  # type: ignore[valid-type]
    Discriminator(_form),
]
"""[support] or [[support]]."""


def own_law(support: OneSupport) -> ChosenLaw | None:
    """Return the contact law that a support names; None: that of [contact] acts there."""
    return support.law if isinstance(support, SupportWithLaw) else None


def law_at(contact: Contact, support: OneSupport | None) -> ChosenLaw:
    """Return the contact law that acts at a support; None: at one without a law of its own."""
    own = None if support is None else own_law(support)
    return contact.law if own is None else own
