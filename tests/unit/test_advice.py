"""Advice of refusals, applied as it stands: what was refused is accepted, and nothing else is refused instead."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.messages.errors import CaseError, Fault, Key
from tests.shared.case_texts import GOOD, spoiled
from tests.unit.test_case_consistency import CONTRADICTIONS

VALUE = r'(?:\[[^\]]*\]|"[^"]*"|\{[^}]*\}|true|false|[-+]?\d(?:[-+.\de]*\d)?)'
PART = rf"(?:[a-z][a-z_]*(?:\.[a-z_]+)* = {VALUE})"
PIECE = re.compile(
    rf"(?:\[(?P<before>[\w.]+)\] )?(?P<parts>{PART}(?:(?:, | and ){PART})*)(?: in \[(?P<after>[\w.]+)\])?"
    r"(?P<rest>[^;,]{0,12})"
)
DRAWN = {
    "contact.law": (
        '"kelvin-voigt"', '{ type = "hunt-crossley", restitution = 0.8 }',
        '{ type = "kelvin-voigt", restitution = 0.8 }', '{ type = "lankarani-nikravesh", restitution = 0.8 }',
        '{ type = "piecewise-linear", depths = [1e-5], factors = [3.0] }',
        '{ type = "elastic-plastic", yield_pressure = 1e6 }',
    ),
    "contact.formulation": ('"penalty"', '"nitsche"', '"unilateral"', '"augmented-lagrangian"'),
    "contact.tension": ('"adhesive"', '"clipped"'),
    "contact.damping": ("1e5", "0.0"),
    "contact.stiffness": ("1e10", "1e14"),
    "contact.friction": ("{ coefficient = 0.3 }",),
    "contact.mass": ('"redistributed"',),
    "model.type": ('"rigid"', '"beam"', '"reduced"', '"full"', '"auto"'),
    "time.scheme": (
        '"discrete-gradient"', '"implicit-midpoint"', '"generalized-alpha"', '"moreau-jean"', '"central-difference"',
    ),
    "time.step": ('"auto"', "0.7", "1e-9", "3e-2"),
    "analysis.type": ('"periodic"', '"transient"'),
    "mesh.dimension": ("3",),
    "mesh.degree": ("1", "2"),
    "beam.section": ('"round"', '{ type = "tube", wall = 0.002 }'),
    "support.clearance": ("-0.008", "0.0", "0.2"),
    "support.length": ("0.6",),
    "output.fields_interval": ("1.3e-4",),
    "output.history_interval": ("1.5e-4",),
    "output.stress": ("true",),
}  # fmt: skip
"""Values of keys whose combinations contradict each other often."""


def faults_of(text: str, overrides: Sequence[str] = ()) -> tuple[Fault, ...]:
    """Return the faults of a case; none where it is accepted."""
    try:
        read_case_text(text, list(overrides))
    except CaseError as refused:
        return refused.faults
    return ()


def advice_of(fault: Fault) -> Iterator[list[str]]:
    """Yield the pieces of advice of a fault, each as overrides that belong together."""
    for found in PIECE.finditer(fault.hint):
        if re.match(r" (is|for both)\b", found["rest"]):  # a definition, or two keys
            continue
        table = found["before"] or found["after"]
        path = table.split(".") if table else [str(part) for part in fault.key[:-1]]
        parts = re.findall(PART, found["parts"])
        yield [part if "." in part.split(" = ")[0] else ".".join([*path, part]) for part in parts]


def check_advice(text: str, given_: Sequence[str] = ()) -> int:
    """Check all advice about a case; return how many pieces there were."""
    faults, count = faults_of(text, given_), 0
    for fault in faults:
        hidden = _hidden_by(fault.key, text, given_)
        for overrides in advice_of(fault):
            keys = {one.split(" = ")[0] for one in overrides}
            kept = [one for one in given_ if one.split(" = ")[0] not in keys]
            after = faults_of(text, [*kept, *overrides])
            same = [one for one in after if (one.key, one.expected) == (fault.key, fault.expected)]
            fresh = [one for one in after if one.key not in {*hidden, *(before.key for before in faults)}]
            assert not same, f"{given_}: {overrides} does not help:\n{fault}"
            assert not fresh, f"{given_}: {overrides} is refused in its turn:\n{fault}\n{fresh[0]}"
            count += 1
    return count


def _hidden_by(key: Key, text: str, given_: Sequence[str]) -> set[Key]:
    """Return the keys of faults that are there without the faulty value as well, and wait for it to be mended."""
    name = ".".join(map(str, key))
    rest = [one for one in given_ if not (name + ".").startswith(one.split(" = ")[0] + ".")]
    return {one.key for one in faults_of(text, rest)}


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_advice_about_contradictions_helps(name: str) -> None:
    """Whatever two keys contradict each other."""
    old, new, _ = CONTRADICTIONS[name]
    check_advice(spoiled(old, new))


CHOICES = [f"{key} = {value}" for key, values in DRAWN.items() for value in values]


@settings(deadline=None, max_examples=250, derandomize=True)
@given(st.lists(st.sampled_from(CHOICES), min_size=1, max_size=4, unique_by=lambda one: one.split(" = ")[0]))
def test_advice_about_drawn_cases_helps(choices: list[str]) -> None:
    """Whatever choices stand side by side."""
    check_advice(GOOD, choices)


def test_advice_is_read() -> None:
    """Tables before and behind, several keys, several pieces."""
    fault = Fault(("model", "type"), "a", "b", 'a = 1 and b = "x" in [contact], or [time] step = 1e-4; c = [1, 2]')
    assert list(advice_of(fault)) == [
        ["contact.a = 1", 'contact.b = "x"'],
        ["time.step = 1e-4"],
        ["model.c = [1, 2]"],
    ]
