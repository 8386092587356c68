"""Contradictions of loads, damping, friction and limits of a run, and what needs a factor of the operator."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.analysis_table import Analysis, Periodic
from gapbeam.solver.case.case import Damping
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.solution_tables import FullModel, Gates, ModelTable, SolverTable, Time
from gapbeam.solver.errors import Fault, Key
from gapbeam.solver.supports.layout import keyed, support_at
from gapbeam.solver.supports.support_tables import AnySupports
from gapbeam.solver.wording.short_words import apart, exceeds


def loads_are_sound(load: Loads) -> Iterator[Fault]:
    """Each load by itself, such as the file of a record."""
    for number, entry in load.items():
        yield from entry.faults(("load", number))


def loads_fit_each_other(load: Loads) -> Iterator[Fault]:
    """Loads agree with each other, such as those that share the noise of another one."""
    for number, entry in load.items():
        yield from entry.faults_among(("load", number), load)


def loads_fit_the_run(time: Time, load: Loads) -> Iterator[Fault]:
    """Each load in the run, such as a record that has to cover it."""
    for number, entry in load.items():
        yield from entry.faults_in_run(("load", number), time.end, None if time.step == "auto" else time.step)


def attached_masses_sit_on_mass(support: AnySupports, contact: Contact, load: Loads) -> Iterator[Fault]:
    """Masses of loads, such as exciters, need nodes with mass."""
    if contact.mass != "redistributed":
        return
    for number, entry in load.items():
        point = entry.place.point
        if entry.attachment is None or point is None:
            continue
        x = point[0] if isinstance(point, tuple) else point
        held = support_at(support, x)
        if held is not None:
            yield Fault(
                ("load", number, "point"),
                f"x = {x:g} m, in the support, whose contact nodes have no mass",
                f"an {entry.type} at x above {held.end:g} m, or contact nodes with mass",
                f'contact.mass = "consistent", or move the {entry.type} out of the support',
                (("contact", "mass"),),
            )


def static_force_names_differ(load: Loads) -> Iterator[Fault]:
    """The static force that a load adds, such as a preload, has a name in results, which no other load may have."""
    for number, entry in load.items():
        if (added := entry.static_force) is None:
            continue
        for other, named in load.items():
            if named.name == added.name:
                yield Fault(
                    ("load", other, "name"),
                    f'"{named.name}", which the static force of number {number + 1} is called in results',
                    "a different name for every load",
                    f'name = "{named.type}_{other + 1}"',
                    (("load", number, "name"),),
                )


def damping_is_given_once(damping: Damping) -> Iterator[Fault]:
    """Rayleigh damping is given by frequencies and ratios, or by its two coefficients, and never by half."""
    pairs = (("frequencies", "ratios"), ("mass", "stiffness"))
    given = [name for pair in pairs for name in pair if getattr(damping, name) is not None]
    ways = [[name for name in pair if name in given] for pair in pairs]
    if all(ways):
        yield Fault(
            ("damping", given[-1]),
            f"{', '.join(given)}: damping given in two ways",
            "frequencies and ratios, or mass and stiffness",
            "remove one of the two pairs",
            tuple(("damping", name) for name in given[:-1]),
        )
        return
    for pair, way in zip(pairs, ways, strict=True):
        if len(way) == 1:
            missing = pair[1 - pair.index(way[0])]
            zero = f"; {missing} = 0.0 if there is none" if missing in pairs[1] else ""
            yield Fault(
                ("damping", way[0]),
                f"{way[0]} without {missing}",
                f"both {pair[0]} and {pair[1]}",
                f"add {missing}{zero}",
            )


def damping_is_positive(damping: Damping) -> Iterator[Fault]:
    """Two different frequencies, and ratios for which neither coefficient is negative."""
    if damping.frequencies is None or damping.ratios is None:
        return
    (low, low_ratio), (high, high_ratio) = sorted(zip(damping.frequencies, damping.ratios, strict=True))
    if low == high:
        yield Fault(
            ("damping", "frequencies"),
            f"{low:g} Hz twice",
            "two different frequencies",
            "one below and one above the frequencies of interest",
        )
        return
    least, most = low_ratio * low / high, low_ratio * high / low
    if not least * (1 - 1e-9) <= high_ratio <= most * (1 + 1e-9):
        coefficient = "mass" if high_ratio > most else "stiffness"
        yield Fault(
            ("damping", "ratios"),
            f"{low_ratio:g} at {low:g} Hz and {high_ratio:g} at {high:g} Hz: {coefficient} becomes negative",
            f"a ratio from {least:.4g} to {most:.4g} at {high:g} Hz, for {low_ratio:g} at {low:g} Hz",
            "bring the ratios closer together, or the frequencies further apart",
            (("damping", "frequencies"),),
        )


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


def gates_are_in_order(gates: Gates) -> Iterator[Fault]:
    """Limits of a whole run are at least as large as those of one impact."""
    if exceeds(gates.impact_growth, gates.total_growth):
        found, limit = apart(gates.total_growth, gates.impact_growth)
        yield Fault(
            ("gates", "total_growth"),
            f"{found}, less than impact_growth, {limit}",
            "at least impact_growth: one impact may not end the run while it keeps its own limit",
            f"total_growth = {max(0.05, 20 * gates.impact_growth):g}",
            (("gates", "impact_growth"),),
        )


def limits_are_in_order(gates: Gates) -> Iterator[Fault]:
    """No assumption ends a run that it does not warn of."""
    for name in type(gates.failures).model_fields:
        warning, failure = getattr(gates.warnings, name), getattr(gates.failures, name)
        if isinstance(warning, float) and isinstance(failure, float) and exceeds(warning, failure):
            found, limit = apart(failure, warning)
            yield Fault(
                ("gates", "failures", name),
                f"{found}, less than the warning, {limit}",
                "at least the warning: a run that fails has passed the limit of the warning, too",
                f"{name} = {limit}, or a smaller one in [gates.warnings]",
                (("gates", "warnings", name),),
            )
