"""Modes of a case beside those of the theory, and the end springs that reproduce them or those measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gapbeam.meshes.section_figures import Section
from gapbeam.solver.beam_theory.spring_beam import SpringBeam
from gapbeam.solver.case.case import Case
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam
from gapbeam.solver.modes.contact_modes import CLOSED, FREE, SEATED, HeldModes
from gapbeam.solver.supports.support_tables import BaseAndGland
from gapbeam.studies.modes.end_springs import EndSpringFit, identify_end_springs
from gapbeam.studies.modes.mode_matching import TheoryMode, matched_modes

FITTED = 3  # modes of the body that springs are fitted to: those of the paper
UNKNOWNS = 2  # k1, k2; the length is a third
OVERHANG, WHOLE, BETWEEN = "overhang", "whole", "fitted"


@dataclass(frozen=True)
class SpringFit:
    """Springs fitted with one choice of the length.

    Attributes:
        source: "seated" or "measured": whose frequencies were fitted.
        choice: "overhang", "whole" or "fitted": what the length is.
        fit: The springs.
        modes: Modes of that beam, matched with those of the seated body.
    """

    source: str
    choice: str
    fit: EndSpringFit
    modes: tuple[TheoryMode, ...]


@dataclass(frozen=True)
class ModesComparison:
    """Everything that `gapbeam modes` reports.

    Attributes:
        count: How many bending modes.
        states: The body seated, free and closed.
        clamped: Modes of the overhang clamped at the edge of the base, matched with the seated body; with [[support]]
            there are none.
        free: Modes of the whole beam without springs, matched with the free body.
        fits: Springs for the seated body's frequencies and for those measured, a choice of the length each.
        measured: Measured frequencies by mode, Hz.
        burdened: Whether masses or springs of loads move along with the body, which the theory leaves out.
    """

    count: int
    states: Mapping[str, HeldModes]
    clamped: tuple[TheoryMode, ...]
    free: tuple[TheoryMode, ...]
    fits: tuple[SpringFit, ...]
    measured: Mapping[int, float]
    burdened: bool = False

    def best(self, source: str) -> SpringFit | None:
        """Return the fit with a given length that reproduces a source best; None where there was nothing to fit."""
        given = [one for one in self.fits if one.source == source and one.choice != BETWEEN]
        return min(given, key=lambda one: one.fit.misfit, default=None)


def beams_of(case: Case, section: Section | None = None) -> dict[str, SpringBeam]:
    """Return the beams of the theory: the overhang, from the edge of the base to the tip, and the whole beam.

    Args:
        case: The case.
        section: That of its mesh; None: that of the case.
    """
    beam = TimoshenkoBeam.of_case(case, 1)
    if section is not None:
        share = section.second_moment / case.beam.second_moment
        beam = replace(beam, bending=share * beam.bending, mass=section.area / case.beam.area * beam.mass)
    held = isinstance(case.support, BaseAndGland)
    lengths = ({OVERHANG: case.beam.length - case.layout.end} if held else {}) | {WHOLE: case.beam.length}
    return {name: SpringBeam(length, beam.bending, beam.mass) for name, length in lengths.items()}


def compare_modes(
    case: Case,
    states: tuple[HeldModes, HeldModes, HeldModes],
    count: int,
    measured: Mapping[int, float],
    accuracy: float,
    section: Section | None = None,
) -> ModesComparison:
    """Match the modes of a body with those of the theory and identify end springs; on one rank.

    Args:
        case: Its case.
        states: The body seated, free and closed, with at least `FITTED` bending modes each.
        count: How many bending modes are compared.
        measured: Measured frequencies by mode, Hz; empty: none.
        accuracy: Standard deviation of a frequency, relative.
        section: Of a mesh file; None: that of the case.
    """
    beams = beams_of(case, section)
    seated, free, closed = states
    fits = []
    held = bool(case.joint) or not case.profile.prismatic  # the theory has neither joints nor steps
    overhang = isinstance(case.support, BaseAndGland) and not held
    if overhang and seated.closed > 0:
        frequencies = seated.bending()[0][:FITTED]
        own = {mode: float(frequency) for mode, frequency in enumerate(frequencies, start=1)}
        fits += _fits(SEATED, own, beams, seated, count, accuracy)
    if overhang and measured:
        fits += _fits("measured", measured, beams, seated, count, accuracy)
    return ModesComparison(
        count=count,
        states={SEATED: seated, FREE: free, CLOSED: closed},
        clamped=matched_modes(seated, beams[OVERHANG], (np.inf, np.inf), count) if overhang else (),
        free=() if held else matched_modes(free, beams[WHOLE], (0.0, 0.0), count),
        fits=tuple(fits),
        measured=measured,
        burdened=bool(moving_along(case)),
    )


def moving_along(case: Case) -> list[str]:
    """Return the names of loads, masses and fluids that move along with the body, which the theory leaves out."""
    added = [(load.name, load.attachment) for load in case.load]
    return [name for name, one in added if one is not None and one.mass + one.stiffness > 0.0] + [
        one.name for one in (*case.mass, *case.fluid)
    ]


def _fits(
    source: str,
    frequencies: Mapping[int, float],
    beams: Mapping[str, SpringBeam],
    seated: HeldModes,
    count: int,
    accuracy: float,
) -> list[SpringFit]:
    if len(frequencies) < UNKNOWNS:
        return []
    choices: dict[str, tuple[SpringBeam, tuple[float, float] | None]] = {
        name: (beam, None) for name, beam in beams.items()
    }
    if len(frequencies) > UNKNOWNS:
        choices[BETWEEN] = beams[OVERHANG], (beams[OVERHANG].length, beams[WHOLE].length)
    found = []
    for choice, (beam, lengths) in choices.items():
        fit = identify_end_springs(beam, tuple(frequencies), tuple(frequencies.values()), lengths, accuracy)
        found.append(SpringFit(source, choice, fit, matched_modes(seated, fit.beam, fit.springs, count)))
    return found
