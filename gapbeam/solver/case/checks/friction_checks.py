"""Contradictions between the friction of points that stick and of points that slide."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports
from gapbeam.solver.wording.short_words import apart, exceeds

SLIDING = ("contact", "friction", "coefficient")


def static_friction_holds_more(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """Static friction is at least as large as sliding friction, and there is friction."""
    friction = contact.friction
    if friction is not None and friction.static_coefficient is not None:
        key = ("contact", "friction", "static_coefficient")
        yield from _less(key, friction.static_coefficient, friction.coefficient, SLIDING)
        if friction.coefficient == 0.0 < friction.static_coefficient:
            yield Fault(
                key,
                f"{friction.static_coefficient:g}, with a coefficient of 0",
                "a coefficient above 0: with 0 there is no friction, neither sticking nor sliding",
                "coefficient = 0.2, or leave static_coefficient out",
                (SLIDING,),
            )
    for at, one in keyed(support):
        if one.static_friction is None:
            continue
        if contact.rubs is None:
            yield Fault(
                (*at, "static_friction"),
                f"{one.static_friction:g}, without friction in [contact]",
                "[contact.friction] with a coefficient above 0, which the other supports have",
                "friction = {coefficient = 0.2} in [contact]",
                (("contact", "friction"),) if friction is not None else (),
            )
            continue
        sliding, _ = contact.rubs.at_support(one.friction, one.static_friction)
        related = SLIDING if one.friction is None else (*at, "friction")
        yield from _less((*at, "static_friction"), one.static_friction, sliding, related)


def _less(key: Key, static: float, sliding: float, related: Key) -> Iterator[Fault]:
    if exceeds(sliding, static):
        found, limit = apart(static, sliding)
        yield Fault(
            key,
            f"{found}, less than the {limit} of points that slide",
            f"at least {limit}: what sticks is held by no less than what slides",
            f"{key[-1]} = {1.5 * sliding:g}, or leave {key[-1]} out",
            (related,),
        )
