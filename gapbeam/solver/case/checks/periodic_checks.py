"""Contradictions of searches for periodic responses, and of loads, damping, friction and limits of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import cast

from gapbeam.solver.case.analysis_table import Analysis, Periodic
from gapbeam.solver.case.case import Contact, Damping
from gapbeam.solver.case.checks.contact_checks import idle_keys, laws_of, rubbing
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.solution_tables import FullModel, Gates, ModelTable, SolverTable, Time
from gapbeam.solver.contact.laws.law_choice import LAWS
from gapbeam.solver.integrators.scheme_choice import scheme_names
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, either, exceeds
from gapbeam.solver.supports.layout import Layout, keyed, support_at, variable_key
from gapbeam.solver.supports.support_tables import AnySupports

TYPE: Key = ("analysis", "type")
NOT_NEGATIVE = ("contact.stiffness", "contact.damping")


def forcing_is_periodic(analysis: Analysis, load: Loads) -> Iterator[Fault]:
    """A periodic response has one forcing frequency."""
    if not isinstance(analysis, Periodic):
        return
    for number, entry in load.items():
        if not entry.repeats:
            yield Fault(
                TYPE,
                f'"periodic", with the {entry.type.replace("_", " ")} "{entry.name}"',
                "harmonic loads of one frequency: no period is sought in a load that never repeats",
                'type = "transient" marches whatever the loads are',
                (("load", number, "type"),),
            )
            return
    found_in = {number: entry.forcing_frequency for number, entry in load.items()}
    frequencies = {number: frequency for number, frequency in found_in.items() if frequency is not None}
    known = sorted(set(frequencies.values()))
    if len(known) == 1:
        return
    found = f"loads of {', '.join(f'{value:g} Hz' for value in known)}" if known else "no harmonic load"
    yield Fault(
        TYPE,
        f'"periodic", with {found}',
        "harmonic loads of one frequency",
        'type = "transient" marches whatever the loads are',
        tuple(("load", number, "frequency") for number in frequencies),
    )


def period_map_is_smooth(analysis: Analysis, contact: Contact, support: AnySupports) -> Iterator[Fault]:
    """The search needs contact that depends on the state alone, and knows its derivative."""
    if not isinstance(analysis, Periodic):
        return
    if (rubs := rubbing(support, contact)) is not None:
        key, sliding = rubs
        yield Fault(
            key,
            f"a coefficient of {sliding:g}, in the search for a periodic response",
            "no friction: its derivative is not followed",
            'leave friction out, or analysis.type = "transient"',
            (TYPE,),
        )
    for key, law in laws_of(support, contact):
        if law.by_touch_speed:
            fit = (name for name, table in LAWS.items() if not table.by_touch_speed and not table.keeps_set)
            of_state = either(fit)
            yield Fault(
                key,
                f"{law.type}, whose damping follows from the speed at touch, in the search for a periodic response",
                f"{of_state}: contact that depends on the state alone",
                'law = "kelvin-voigt" with a damping',
                (TYPE,),
            )
    if contact.formulation.left_by_multipliers is not None:
        yield Fault(
            ("contact", "formulation"),
            f"{contact.formulation.type}, in the search for a periodic response",
            "penalty, unilateral or nitsche: the derivative of multipliers is not followed",
            'formulation = "penalty"',
            (TYPE,),
        )


def _scheme_for(contact: Contact, trait: str) -> str:
    """Return the advice to take a scheme with a trait that the formulation of contact can be marched with."""
    names = scheme_names(trait)
    usual = "implicit-midpoint" if contact.formulation.without_potential else "discrete-gradient"
    return f'scheme = "{usual if usual in names else names[0]}"'


def shooting_has_whole_steps(analysis: Analysis, time: Time, contact: Contact) -> Iterator[Fault]:
    """Shooting marches periods in equal steps of a midpoint rule."""
    if not isinstance(analysis, Periodic) or analysis.method != "shooting":
        return
    if not time.scheme.has_period_map:
        yield Fault(
            ("time", "scheme"),
            f"{time.scheme.type}, with analysis.method shooting",
            f"{either(scheme_names('has_period_map'))}: the map over a period is linearized for these",
            _scheme_for(contact, "has_period_map"),
            (TYPE,),
        )
    if time.adaptive:
        yield Fault(
            ("time", "adaptive"),
            "true, with analysis.method shooting",
            "false: a period has the same steps in every iteration",
            "adaptive = false, and a smaller time.step",
            (TYPE,),
        )


def model_is_dense(analysis: Analysis, model: ModelTable) -> Iterator[Fault]:
    """Harmonic balance and curves work on models of few DOFs."""
    if not isinstance(analysis, Periodic) or not isinstance(model, FullModel):
        return
    if analysis.method == "harmonic-balance" or analysis.continuation is not None:
        what = "harmonic balance" if analysis.method == "harmonic-balance" else "a curve"
        related: Key = ("analysis", "method" if analysis.method == "harmonic-balance" else "continuation")
        yield Fault(
            ("model", "type"),
            f"full, with {what}",
            "reduced, beam or rigid: a model of few degrees of freedom",
            'model.type = "reduced"',
            (related,),
        )


def balance_has_a_law(analysis: Analysis, contact: Contact) -> Iterator[Fault]:
    """Harmonic balance needs a law with finite slopes, and mass everywhere."""
    if not isinstance(analysis, Periodic) or analysis.method != "harmonic-balance":
        return
    method: Key = ("analysis", "method")
    if not contact.formulation.follows_the_law:
        expected = "penalty: the harmonics of contact forces follow from a law"
        yield Fault(
            ("contact", "formulation"), contact.formulation.type, expected, 'formulation = "penalty"', (method,)
        )
    if contact.mass == "redistributed":
        expected = "consistent: harmonic balance works in modes, which massless nodes do not have"
        yield Fault(("contact", "mass"), "redistributed", expected, "leave mass out", (method,))


def march_reaches_the_amplitude(analysis: Analysis, time: Time, load: Loads) -> Iterator[Fault]:
    """The march that a search starts from reaches the steady forcing."""
    if not isinstance(analysis, Periodic) or analysis.start != "march":
        return
    for number, entry in load.items():
        if entry.repeats and exceeds(entry.rise_time, time.end):
            found, limit = apart(time.end, entry.rise_time)
            yield Fault(
                ("time", "end"),
                f"{found} s, within the ramp of {limit} s of a load",
                f"at least {limit} s: the search starts from what the full amplitude has brought about",
                f"end = {2 * entry.rise_time:g}",
                (("load", number, "ramp"),),
            )


def curve_is_in_reach(analysis: Analysis, support: AnySupports, contact: Contact, load: Loads) -> Iterator[Fault]:
    """A response curve varies a number of the case, which lies in the range of the curve."""
    if not isinstance(analysis, Periodic) or analysis.continuation is None:
        return
    curve, table = analysis.continuation, ("analysis", "continuation")
    if analysis.method != "shooting":
        yield Fault(
            ("analysis", "method"),
            f"{analysis.method}, with [analysis.continuation]",
            "shooting: curves are followed by it",
            'method = "shooting"',
            (table,),
        )
    value = value_of(curve.key, {"support": support, "contact": contact}, load)
    if value is None:
        known = (*_of_supports(support), "contact.stiffness or contact.damping where it is a number", *_of_loads(load))
        yield Fault((*table, "key"), curve.key, either(known), "loads are called by their names")
        return
    if curve.key in [f"contact.{key}" for key in idle_keys(contact, Layout.of(support))]:
        yield Fault(
            (*table, "key"),
            f"{curve.key}, which acts at no support: each brings its own",
            "a key that changes the response",
            f"leave {curve.key.partition('.')[2]} out of each [[support]]",
            (("support",),),
        )
    elif not curve.low < curve.high:
        high, low = apart(curve.high, curve.low)
        yield Fault((*table, "high"), high, f"more than low, {low}", "swap them?", ((*table, "low"),))
    elif exceeds(curve.low, value) or exceeds(value, curve.high):
        limit, here = apart(curve.low if value < curve.low else curve.high, value)
        low, high = (limit, f"{curve.high:g}") if value < curve.low else (f"{curve.low:g}", limit)
        yield Fault(
            (*table, "low"),
            f"a range from {low} to {high}",
            f"a range that holds the value of the case, {curve.key} = {here}: the curve starts there",
            f"low = {here}, high = {high}" if value < curve.low else f"low = {low}, high = {here}",
            ((*table, "high"),),
        )
    elif curve.low <= 0.0 and _limit(curve.key, load) == "gt":
        yield Fault((*table, "low"), f"{curve.low:g}, of {curve.key}", "a value above 0", f"low = {0.1 * value:g}")
    elif curve.low < 0.0 and (curve.key in NOT_NEGATIVE or _limit(curve.key, load) == "ge"):
        yield Fault((*table, "low"), f"{curve.low:g}, of {curve.key}", "0 or more", "low = 0.0")


def value_of(key: str, tables: Mapping[str, object], load: Loads) -> float | None:
    """Return the value of a key that a curve may vary, None of other keys: the case is remade cheaply.

    Args:
        key: "support.clearance", or "support.NAME.clearance" of a [[support]]; "contact.stiffness", "contact.damping";
            or "load.NAME.KEY" with one of the keys that a load lets vary, such as its frequency and amplitude.
        tables: The tables support and contact, by name.
        load: The loads.
    """
    if key in _of_loads(load):
        _, name, field = key.split(".")
        return float(next(getattr(entry, field) for entry in load.values() if entry.name == name))
    table, _, field = key.partition(".")
    if table == "support":
        return _of_supports(cast("AnySupports", tables["support"])).get(key)
    if key not in NOT_NEGATIVE:
        return None
    value = getattr(tables[table], field)
    return float(value) if isinstance(value, float | int) else None


def _limit(key: str, load: Loads) -> str:
    """Return "gt" for a key of a load that is above 0, "ge" for one that is not negative, "" for others."""
    _, name, field = key.split(".") if key in _of_loads(load) else ("", "", "")
    rules = [rule for entry in load.values() if entry.name == name for rule in type(entry).model_fields[field].metadata]
    return next((word for word in ("gt", "ge") for rule in rules if getattr(rule, word, None) == 0), "")


def _of_supports(support: AnySupports) -> dict[str, float]:
    """Return the clearances that a curve may vary by their keys, m."""
    return {".".join((*variable_key(one), "clearance")): one.clearance for _, one in keyed(support)}


def _of_loads(load: Loads) -> list[str]:
    known = []
    for entry in load.values():
        known += [f"load.{entry.name}.{field}" for field in entry.curve_units]
    return known


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
        sliding, _ = contact.usual_friction.at_support(one.friction, one.static_friction)
        if sliding == 0.0:
            yield Fault(
                (*at, "static_friction"),
                f"{one.static_friction:g}, without friction of points that slide",
                "friction above 0: with 0 there is no friction, neither sticking nor sliding",
                f"friction = {one.static_friction / 1.5:g} beside static_friction",
                (("contact", "friction"),) if friction is not None else (),
            )
            continue
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


def factor_needed(
    model: ModelTable, support: AnySupports, contact: Contact, time: Time, analysis: Analysis
) -> tuple[Key, str] | None:
    """Return key and words of a choice that needs a factor, or None: only the full model marches with one."""
    if not isinstance(model, FullModel):
        return None
    formulation = contact.formulation
    if not formulation.follows_the_law:
        return ("contact", "formulation"), f"the formulation {formulation.type}"
    if (rubs := rubbing(support, contact)) is not None:
        return rubs[0], "friction"
    if contact.mass == "redistributed":
        return ("contact", "mass"), 'contact.mass = "redistributed"'
    if time.scheme.needs_factor:
        return ("time", "scheme"), f"the scheme {time.scheme.type}"
    if isinstance(analysis, Periodic):
        return ("analysis", "type"), "a search for periodic responses"
    return None


def iterations_can_solve(
    model: ModelTable, support: AnySupports, contact: Contact, time: Time, analysis: Analysis, solver: SolverTable
) -> Iterator[Fault]:
    """Iterations replace a factor for penalty contact without friction, in implicit marches."""
    needed = factor_needed(model, support, contact, time, analysis) if solver.effective == "iterative" else None
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
