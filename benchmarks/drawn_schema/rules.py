"""Rules for drawn numbers and texts: one for every key whose values the schema does not list.

A key without a rule, and without named values, ends a draw: whoever adds a key says here how it is drawn.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any

ELASTIC = ((2.1e11, 7850.0), (7.0e10, 2700.0), (3.0e9, 1200.0))
"""Young's modulus, Pa, and density, kg/m^3: steel, aluminum, a plastic."""


@dataclass(frozen=True)
class Scene:
    """A beam in its support, and how fast it moves.

    Attributes:
        folder: Folder for the files of the case.
        seed: Seed of the case.
        length: m.
        thickness: m.
        width: m.
        support: Length of the support, m.
        clearance: m; negative: an interference fit.
        modulus: Young's modulus, Pa.
        density: kg/m^3.
        bending: First bending frequency of the clamped overhang, Hz.
        frequency: Frequency of the forcing, Hz.
        step: Time step, s, about a whole part of the forcing period.
        periods: Forcing periods in the run.
    """

    folder: Path
    seed: int
    length: float
    thickness: float
    width: float
    support: float
    clearance: float
    modulus: float
    density: float
    bending: float
    frequency: float
    step: float
    periods: int

    @property
    def mass(self) -> float:
        """Mass of the beam, kg."""
        return self.density * self.length * self.thickness * self.width

    @property
    def stiffness(self) -> float:
        """Young's modulus over a third of the thickness, Pa/m: the scale of contact stiffness."""
        return 3.0 * self.modulus / self.thickness

    @property
    def shallow(self) -> float:
        """A depth that contacts reach, m."""
        return 1.0e-2 * abs(self.clearance)


def drawn_scene(chance: random.Random, folder: Path, seed: int) -> Scene:
    """Draw the scales of a case: beams of 0.1 to 1 m, some short and thick, most slender."""
    length = chance.uniform(0.1, 1.0)
    thickness = length * chance.choice((0.015, 0.03, 0.05, 0.1)) * chance.uniform(0.8, 1.2)
    support = length * chance.uniform(0.1, 0.4)
    modulus, density = chance.choice(ELASTIC)
    bending = 0.1615 * (modulus / density) ** 0.5 * thickness / (length - support) ** 2
    frequency = float(f"{bending * chance.uniform(0.1, 1.5):.3g}")
    interference = chance.random() < 0.15
    play = -chance.uniform(1e-4, 5e-4) if interference else 10.0 ** chance.uniform(-3.5, -1.7)
    count = chance.choice((50, 100)) * max(1, round(bending / frequency))
    return Scene(
        folder,
        seed,
        length,
        thickness,
        thickness * chance.uniform(0.5, 3.0),
        support,
        thickness * play,
        modulus,
        density,
        bending,
        frequency,
        float(f"{1.0 / (frequency * count):.3g}"),
        chance.choice((3, 5, 8)),
    )


ROWS = 24  # in a forcing period
NAME, SPECTRUM = "record.csv", "spectrum.csv"


def write_record(chance: random.Random, scene: Scene) -> str:
    """Write a record of a size of about 1 that covers the run, and return its path.

    A sum of three waves of one to three times the forcing frequency, with the rows of a logger that is not quite even.
    """
    waves = [(chance.uniform(0.2, 1.0), order, chance.uniform(0.0, 6.28)) for order in (1, 2, 3)]
    total = sum(size for size, _, _ in waves)
    period = 1.0 / scene.frequency
    lines = ["time [s],signal"]
    for row in range(int((scene.periods + 2) * ROWS) + 1):
        time = period * row / ROWS
        value = sum(size * math.sin(6.2831853 * order * time / period + phase) for size, order, phase in waves)
        lines.append(f"{time:.9g},{value / total:.6g}")
    path = scene.folder / NAME
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def write_spectrum(chance: random.Random, scene: Scene) -> str:
    """Write densities of about 1 around the forcing frequency, and return the path of their file."""
    rows = [f"{share * scene.frequency:.9g};{chance.uniform(0.1, 1.0):.4g}" for share in (0.5, 1.0, 2.0, 4.0)]
    path = scene.folder / SPECTRUM
    path.write_text("\n".join(["f [Hz];S", *rows]) + "\n", encoding="utf-8")
    return str(path)


EARLIER = "earlier"  # folder with the results of the run whose last state a case starts from


class LeftOut:
    """Instead of a value: the key is not given."""


LEFT_OUT = LeftOut()
Rule = Callable[[random.Random, Scene], Any]


def between(least: float, most: float) -> Rule:
    """Return a rule for a number, evenly drawn."""
    return lambda chance, _: chance.uniform(least, most)


def powers(least: float, most: float) -> Rule:
    """Return a rule for a number whose exponent to the base 10 is evenly drawn."""
    return lambda chance, _: 10.0 ** chance.uniform(least, most)


def one_of(*values: Any) -> Rule:
    """Return a rule for one of some values."""
    return lambda chance, _: chance.choice(values)


def never(_: random.Random, __: Scene) -> LeftOut:
    """Leave a key out at all times."""
    return LEFT_OUT


def seldom(rule: Rule, share: float = 0.25) -> Rule:
    """Return a rule that leaves the key out most of the time."""
    return lambda chance, scene: rule(chance, scene) if chance.random() < share else LEFT_OUT


def _point(chance: random.Random, scene: Scene) -> float:
    """Draw a place on the axis: the tip, the middle, or anywhere at a hundredth of the length."""
    return scene.length * chance.choice((1.0, 1.0, 0.5, round(chance.uniform(0.02, 0.98), 2)))


def _frequency(chance: random.Random, scene: Scene) -> float:
    return scene.frequency * chance.choice((1.0, 1.0, 1.0, 1.0, 2.0))


def _force(chance: random.Random, scene: Scene) -> float:
    return 9.81 * scene.mass * float(10.0 ** chance.uniform(-1.5, 0.7))


def _preload(chance: random.Random, scene: Scene) -> float:
    return 0.3 * 9.81 * scene.mass * chance.uniform(-1.0, 1.0)


def _ramp(chance: random.Random, scene: Scene) -> float:
    return chance.choice((0.0, 1.0, 2.0)) / scene.frequency


def _contact_points(chance: random.Random, scene: Scene) -> list[float]:
    return [scene.support * share for share in chance.choice(((0.0, 1.0), (0.05, 0.95), (0.0, 0.5, 1.0)))]


def _spring(chance: random.Random, scene: Scene) -> float:
    return float(scene.mass * (2.0 * pi * scene.bending) ** 2 * 10.0 ** chance.uniform(-1.0, 2.0))


def _turn(chance: random.Random, scene: Scene) -> float:
    return scene.length**2 * _spring(chance, scene)


def _damper(chance: random.Random, scene: Scene) -> float:
    return float(scene.mass * 2.0 * pi * scene.bending * 10.0 ** chance.uniform(-2.0, 0.0))


def _turning_damper(chance: random.Random, scene: Scene) -> float:
    return scene.length**2 * _damper(chance, scene)


def _inclined(chance: random.Random, scene: Scene) -> float:
    return abs(scene.clearance) / scene.support * chance.uniform(-0.3, 0.3)


def _thin(chance: random.Random, *sides: float) -> float:
    return min(sides) * chance.uniform(0.1, 0.3)


def _corners(chance: random.Random, scene: Scene) -> list[list[float]]:
    """Draw a rectangle, or a T upside down: both can be combined with rectangles."""
    y, z = 0.5 * scene.width, 0.5 * scene.thickness
    web, flange = chance.choice((1.0, 0.4)) * y, chance.uniform(-0.4, 0.4) * z
    right = [[y, -z], [y, flange], [web, flange], [web, z]] if web < y else [[y, -z], [y, z]]
    return [*right, *([-one, other] for one, other in reversed(right))]


RULES: dict[tuple[str, str], Rule] = {
    ("Case", "title"): lambda _, scene: f"drawn {scene.seed}",
    ("Beam", "length"): lambda _, scene: scene.length,
    ("Beam", "thickness"): lambda _, scene: scene.thickness,
    ("Beam", "width"): lambda _, scene: scene.width,
    ("BoxSection", "wall"): lambda chance, scene: _thin(chance, scene.thickness, scene.width),
    ("ISection", "web"): lambda chance, scene: _thin(chance, scene.width),
    ("ISection", "flange"): lambda chance, scene: _thin(chance, scene.thickness),
    ("PolygonSection", "points"): _corners,
    ("PolygonSection", "holes"): never,
    ("TubeSection", "wall"): lambda chance, scene: _thin(chance, scene.thickness),
    ("Material", "young_modulus"): lambda _, scene: scene.modulus,
    ("Material", "poisson_ratio"): between(0.0, 0.45),
    ("Material", "density"): lambda _, scene: scene.density,
    ("Material", "yield_stress"): seldom(between(1.0e8, 4.0e8)),
    ("Segment", "name"): never,  # names and places follow the supports, `drawn_segments`
    ("PlacedSegment", "from"): never,
    ("PlacedSegment", "to"): never,
    ("Segment", "thickness"): seldom(lambda chance, scene: scene.thickness * chance.choice((0.8, 1.25)), 0.5),
    ("Segment", "width"): never,
    ("Segment", "young_modulus"): seldom(lambda chance, scene: scene.modulus * chance.choice((0.4, 0.7)), 0.5),
    ("Segment", "poisson_ratio"): seldom(between(0.0, 0.45)),
    ("Segment", "density"): lambda chance, scene: scene.density * chance.choice((0.4, 0.7)),
    ("Segment", "yield_stress"): seldom(between(1.0e8, 4.0e8)),
    ("Damping", "frequencies"): lambda _, scene: [scene.bending, 6.0 * scene.bending],
    ("Damping", "ratios"): lambda chance, _: [chance.choice((0.002, 0.01, 0.03))] * 2,
    ("Damping", "mass"): lambda chance, scene: chance.choice((0.0, 0.05)) * scene.bending,
    ("Damping", "stiffness"): lambda chance, scene: chance.choice((0.0, 3.0e-3, 1.0e-2)) / scene.bending,
    ("Damping", "ratio"): seldom(one_of(0.002, 0.01, 0.03), 0.1),
    ("BaseAndGland", "length"): lambda _, scene: scene.support,
    ("BaseAndGland", "clearance"): lambda _, scene: scene.clearance,
    ("PlacedSupport", "clearance"): lambda chance, scene: scene.clearance * chance.choice((1.0, 1.0, 2.0, 0.0)),
    ("PlacedSupport", "offset"): seldom(lambda chance, scene: abs(scene.clearance) * chance.uniform(-0.5, 0.5), 0.4),
    ("PlacedSupport", "lateral"): seldom(lambda chance, scene: abs(scene.clearance) * chance.uniform(-0.5, 0.5), 0.2),
    ("PlacedSupport", "tilt"): seldom(_inclined, 0.1),
    ("Polygon", "walls"): one_of(
        [-45.0, 45.0, 180.0], [0.0, 90.0, 180.0, 270.0], [30.0, 90.0, 150.0, 210.0, 270.0, 330.0]
    ),
    ("Polygon", "recesses"): never,  # as many as walls
    ("Profile", "angles"): one_of([-180.0, -90.0, 0.0, 90.0]),
    ("Profile", "recesses"): lambda chance, scene: [abs(scene.clearance) * chance.uniform(0.0, 0.5) for _ in range(4)],
    ("PlacedSupport", "stiffness"): seldom(lambda chance, scene: scene.stiffness * 10.0 ** chance.uniform(-2, 0), 0.25),
    ("PlacedSupport", "damping"): seldom(lambda _, scene: 1.0e-5 * scene.stiffness, 0.1),
    ("PlacedSupport", "support_stiffness"): never,  # instead of stiffness: tests/verification/test_whole_supports
    ("PlacedSupport", "support_damping"): never,
    ("PlacedSupport", "friction"): seldom(one_of(0.0, 0.2, 0.5), 0.1),
    ("PlacedSupport", "static_friction"): never,  # at least friction
    ("PlacedSupport", "law"): never,  # its stiffness has a unit of its own
    ("PlacedSupport", "wear"): never,  # only with [wear]
    ("PlacedSupport", "area"): never,  # only with [wear]
    ("PlacedSupport", "depth_limit"): never,
    ("Wear", "coefficient"): one_of(1.0e-14, 1.0e-13),
    ("Wear", "area"): seldom(powers(-6.0, -4.0)),
    ("Wear", "depth_limit"): never,  # only with an area; runs do not see it
    ("SupportBody", "mass"): lambda chance, scene: scene.mass * chance.choice((0.03, 0.1, 0.5)),
    ("SupportBody", "stiffness"): _spring,
    ("SupportBody", "damping"): seldom(_damper, 0.7),
    ("SupportBody", "displacement"): never,  # only of a march, and away from the beam
    ("SupportBody", "velocity"): never,  # only of a march
    ("PlacedSupport", "from"): never,  # places and names follow each other, `finishing`
    ("PlacedSupport", "to"): never,
    ("PlacedSupport", "name"): never,
    ("Joint", "name"): never,  # names and places follow each other, `finishing`
    ("Joint", "point"): never,
    ("Stiffnesses", "axial"): seldom(_spring, 0.1),
    ("Stiffnesses", "vertical"): seldom(_spring, 0.7),
    ("Stiffnesses", "lateral"): seldom(_spring, 0.1),
    ("Stiffnesses", "rotation"): seldom(_turn, 0.7),
    ("Stiffnesses", "lateral_rotation"): seldom(_turn, 0.1),
    ("Stiffnesses", "twist"): seldom(_turn, 0.1),
    ("Dampings", "axial"): seldom(_damper, 0.1),
    ("Dampings", "vertical"): seldom(_damper, 0.5),
    ("Dampings", "lateral"): seldom(_damper, 0.1),
    ("Dampings", "rotation"): seldom(_turning_damper, 0.5),
    ("Dampings", "lateral_rotation"): seldom(_turning_damper, 0.1),
    ("Dampings", "twist"): seldom(_turning_damper, 0.1),
    ("Fluid", "name"): never,
    ("Fluid", "from"): lambda chance, scene: round(scene.length * chance.choice((0.0, 0.2)), 6),
    ("Fluid", "to"): lambda chance, scene: round(scene.length * chance.choice((0.7, 1.0)), 6),
    ("Fluid", "added_mass"): lambda chance, scene: scene.mass / scene.length * chance.choice((0.1, 0.5, 2.0)),
    ("Fluid", "displaced_mass"): seldom(lambda _, scene: 0.1 * scene.mass / scene.length),
    ("Fluid", "damping"): seldom(lambda _, scene: 0.01 * scene.mass / scene.length * scene.bending, 0.6),
    ("PointMass", "name"): never,
    ("PointMass", "point"): never,
    ("PointMass", "mass"): lambda chance, scene: scene.mass * chance.choice((0.05, 0.3, 1.0)),
    ("PointMass", "offset"): never,  # it has as many entries as the mesh has dimensions
    ("PointMass", "polar_inertia"): seldom(lambda _, scene: 1.0e-3 * scene.mass * scene.thickness**2),
    ("PointMass", "rotary_inertia"): seldom(lambda _, scene: 1.0e-3 * scene.mass * scene.length**2),
    ("Restraint", "axial"): seldom(powers(1.0, 5.0)),
    ("Restraint", "lateral"): seldom(powers(1.0, 5.0)),
    ("Mesh", "dimension"): one_of(2, 2, 2, 3),
    ("Mesh", "size"): lambda chance, scene: scene.thickness * chance.uniform(1.5, 3.0),
    ("Mesh", "support_size"): lambda chance, scene: scene.support * chance.choice((0.15, 0.25, 0.4)),
    ("Mesh", "edge_size"): seldom(lambda chance, scene: scene.support * chance.choice((0.08, 0.15))),
    ("Mesh", "cells_through_thickness"): one_of(1, 2, 2, 4),
    ("Mesh", "cells_across_width"): one_of(1, 2, LEFT_OUT),
    ("Mesh", "file"): never,  # of a mesh that somebody else built: tests/verification has those
    ("_AnyModel", "reasons"): never,  # written by the model auto
    ("ReducedModel", "modes"): one_of(0, 4, 12, 24, 40, LEFT_OUT),
    ("ReducedModel", "frequency"): seldom(lambda chance, scene: scene.bending * chance.uniform(7.0, 30.0)),
    ("ReducedModel", "shapes"): one_of(2, 5, 13, 19, LEFT_OUT),
    ("ReducedModel", "points_across"): seldom(one_of("all", 1, 2)),
    ("ReducedModel", "stations"): seldom(one_of(2, 6, 12), 0.5),
    ("BeamModel", "elements"): one_of(10, 25, 60, LEFT_OUT),
    ("BeamModel", "stations"): seldom(one_of(1, 3, 8), 0.5),
    ("RigidModel", "stations"): seldom(one_of(1, 3, 8), 0.5),
    ("BeamModel", "motions"): seldom(one_of(["bending", "axial"], ["bending", "lateral"]), 0.1),
    ("Contact", "stiffness"): seldom(lambda chance, scene: scene.stiffness * 10.0 ** chance.uniform(-2.5, 0.5), 0.6),
    ("Contact", "damping"): seldom(lambda chance, scene: scene.stiffness * scene.step * 10.0 ** chance.uniform(-4, -1)),
    ("Contact", "points"): seldom(_contact_points, 0.2),
    ("Contact", "patch"): seldom(lambda chance, scene: scene.support * chance.choice((0.1, 0.2)), 0.1),
    ("Contact", "quadrature_degree"): seldom(one_of(2, 4, 6)),
    ("Contact", "touch_depth"): seldom(lambda _, scene: 1.0e-4 * abs(scene.clearance), 0.15),
    ("Friction", "coefficient"): one_of(0.0, 0.1, 0.3, 0.6),
    ("Friction", "static_coefficient"): never,  # at least coefficient
    ("Friction", "slip_velocity"): seldom(powers(-4.0, -2.0)),
    ("NitscheMethod", "factor"): seldom(between(1.0, 20.0)),
    ("AugmentedLagrangian", "penetration"): seldom(powers(-5.0, -2.0)),
    ("KelvinVoigt", "restitution"): seldom(between(0.4, 1.0)),
    ("HuntCrossley", "exponent"): one_of(1.0, 1.5, LEFT_OUT),
    ("HuntCrossley", "restitution"): between(0.3, 1.0),
    ("LankaraniNikravesh", "exponent"): one_of(1.0, 1.5, LEFT_OUT),
    ("LankaraniNikravesh", "restitution"): between(0.3, 1.0),
    ("AdamsImpact", "exponent"): one_of(1.0, 1.5, 2.2, LEFT_OUT),
    ("AdamsImpact", "damping"): lambda chance, scene: scene.stiffness * scene.step * 10.0 ** chance.uniform(-4, -1),
    ("AdamsImpact", "full_depth"): lambda chance, scene: scene.shallow * chance.choice((0.1, 1.0)),
    ("PiecewiseLinear", "depths"): lambda _, scene: [scene.shallow, 2.0 * scene.shallow],
    ("PiecewiseLinear", "factors"): lambda chance, _: [chance.choice((0.5, 2.0)), chance.choice((1.0, 5.0))],
    ("ElasticPlastic", "yield_pressure"): lambda _, scene: scene.stiffness * scene.shallow,
    ("ElasticPlastic", "yield_force"): never,  # instead of yield_pressure
    ("ElasticPlastic", "hardening"): seldom(one_of(0.0, 0.1, 0.5), 0.5),
    ("LoadTable", "name"): never,  # numbered where the loads are put together
    ("LoadTable", "direction"): never,  # drawn for the dimension of the mesh where the loads are put together
    ("Gravity", "acceleration"): seldom(one_of(1.62, 9.81, 20.0)),
    ("PointLoad", "point"): _point,
    ("HarmonicLoad", "amplitude"): _force,
    ("ConstantForce", "amplitude"): _preload,
    ("StepForce", "amplitude"): _force,
    ("StepForce", "start"): lambda chance, scene: chance.choice((0.0, 1.0)) / scene.frequency,
    ("StepForce", "end"): never,  # after its start and ramp
    ("StepForce", "ramp"): _ramp,
    ("BaseMotion", "amplitude"): lambda chance, _: 9.81 * 10.0 ** chance.uniform(-1.0, 0.8),
    ("MovingSupport", "support"): never,  # named where the loads are put together
    ("HarmonicSupportMotion", "amplitude"): lambda chance, scene: abs(scene.clearance) * chance.choice((0.1, 1.0, 5.0)),
    ("ClearanceChange", "times"): lambda _, scene: [share / scene.frequency for share in (0.0, 1.0, 1.5, 4.0)],
    ("ClearanceChange", "changes"): lambda chance, scene: [
        abs(scene.clearance) * share * chance.choice((-1.0, 1.0)) for share in (0.0, 0.3, 0.5, 0.2)
    ],
    ("HarmonicLoad", "frequency"): _frequency,
    ("HarmonicLoad", "phase"): seldom(between(0.0, 360.0)),
    ("HarmonicLoad", "ramp"): _ramp,
    ("Exciter", "mass"): lambda chance, scene: scene.mass * chance.choice((0.0, 0.05, 0.3)),
    ("Exciter", "stiffness"): lambda chance, scene: scene.mass * (scene.bending * chance.choice((0.0, 1.0, 5.0))) ** 2,
    ("Exciter", "damping"): lambda chance, scene: scene.mass * scene.bending * chance.choice((0.0, 0.05, 0.3)),
    ("Exciter", "preload"): seldom(_preload),
    ("RecordedTable", "file"): write_record,
    ("RecordedTable", "time_column"): seldom(one_of(1, "time")),
    ("RecordedTable", "value_column"): seldom(one_of(2, "signal")),
    ("RecordedTable", "time_scale"): never,
    ("RecordedTable", "scale"): _force,
    ("RecordedMotion", "scale"): lambda chance, _: 9.81 * 10.0 ** chance.uniform(-1.0, 0.5),
    ("RecordedSupportMotion", "scale"): lambda chance, scene: abs(scene.clearance) * chance.choice((0.1, 1.0, 5.0)),
    ("RecordedSupportMotion", "offset"): never,
    ("RecordedTable", "offset"): seldom(lambda chance, scene: 0.1 * 9.81 * scene.mass * chance.uniform(-1, 1), 0.1),
    ("RecordedTable", "start"): seldom(lambda chance, scene: chance.choice((0.0, 0.5)) / scene.frequency),
    ("RecordedTable", "ramp"): _ramp,
    ("RecordedTable", "checksum"): never,
    ("PointOrSupportLoad", "point"): _point,  # left out of accelerations where the loads are put together
    ("UnrepeatedLoad", "ramp"): _ramp,
    ("NoiseLoad", "seed"): seldom(one_of(1, 2, 3)),
    ("CrossSpectrum", "load"): one_of("partner"),  # named, and made, where the loads are put together
    ("CrossSpectrum", "coherence"): one_of(0.0, 0.6, 1.0),
    ("CrossSpectrum", "phase"): seldom(one_of(90.0, -45.0)),
    ("CrossSpectrum", "delay"): seldom(lambda chance, scene: chance.uniform(-1.0, 1.0) / scene.frequency),
    ("CrossSpectrum", "frequencies"): never,
    ("RandomLineLoad", "span"): lambda chance, scene: [0.0, scene.length * chance.choice((0.5, 1.0))],
    ("RandomLineLoad", "stations"): seldom(one_of(6, 12, 20)),
    ("ExponentialCoherence", "length"): lambda chance, scene: scene.length * chance.choice((0.1, 0.4)),
    ("GaussianCoherence", "length"): lambda chance, scene: scene.length * chance.choice((0.1, 0.4)),
    ("MeasuredCoherence", "distances"): lambda _, scene: [0.0, 0.1 * scene.length, 0.4 * scene.length],
    ("MeasuredCoherence", "values"): one_of([1.0, 0.4, 0.0], [1.0, 0.5, 0.0]),
    ("VelocityProfile", "places"): lambda _, scene: [0.0, 0.5 * scene.length, scene.length],
    ("VelocityProfile", "values"): one_of([0.5, 1.0, 1.0], [0.0, 1.0, 0.0]),
    ("SpectrumTable", "scale"): lambda chance, scene: _force(chance, scene) ** 2 / scene.frequency,
    ("WhiteSpectrum", "density"): one_of(0.3, 1.0),
    ("WhiteSpectrum", "low"): seldom(lambda _, scene: 0.5 * scene.frequency, 0.7),
    ("WhiteSpectrum", "high"): lambda _, scene: 3.0 * scene.frequency,
    ("TableSpectrum", "frequencies"): lambda _, scene: [factor * scene.frequency for factor in (0.5, 1.0, 4.0)],
    ("TableSpectrum", "densities"): one_of([0.1, 1.0, 1.0], [1.0, 0.3, 0.01]),
    ("FileSpectrum", "file"): write_spectrum,
    ("FileSpectrum", "frequency_column"): seldom(one_of(1, "f")),
    ("FileSpectrum", "density_column"): seldom(one_of(2, "S")),
    ("FileSpectrum", "checksum"): never,
    ("TurbulenceSpectrum", "velocity"): one_of(0.5, 2.0),
    ("TurbulenceSpectrum", "length"): lambda _, scene: 0.2 / scene.frequency,
    ("TurbulenceSpectrum", "low"): seldom(lambda _, scene: 0.3 * scene.frequency),
    ("TurbulenceSpectrum", "high"): seldom(lambda _, scene: 4.0 * scene.frequency),
    ("SweptSineLoad", "amplitude"): _force,
    ("SweptSineLoad", "start_frequency"): lambda _, scene: 0.5 * scene.frequency,
    ("SweptSineLoad", "end_frequency"): lambda chance, scene: scene.frequency * chance.choice((0.2, 2.0)),
    ("SweptSineLoad", "duration"): lambda _, scene: 5.0 / scene.frequency,
    ("Probe", "name"): never,  # numbered where the probes are put together
    ("Probe", "point"): _point,
    ("Time", "end"): lambda _, scene: scene.periods / scene.frequency,
    ("Time", "step"): lambda chance, scene: chance.choice((scene.step,) * 6 + ("auto",)),
    ("Time", "frequency"): seldom(lambda chance, scene: max(scene.frequency, scene.bending) * chance.uniform(2, 8)),
    ("Time", "max_halvings"): seldom(one_of(0, 3, 10)),
    ("Time", "max_iterations"): seldom(one_of(20, 200)),
    ("Newmark", "beta"): seldom(between(0.25, 0.5)),
    ("Newmark", "gamma"): seldom(between(0.5, 0.7)),
    ("HHTAlpha", "alpha"): seldom(between(0.0, 0.33)),
    ("GeneralizedAlpha", "rho_inf"): seldom(between(0.0, 1.0), 0.7),
    ("MoreauJean", "theta"): seldom(between(0.5, 1.0)),
    ("MoreauJean", "restitution"): seldom(between(0.0, 1.0), 0.6),
    ("StartMotion", "lift"): seldom(lambda chance, scene: 0.2 * abs(scene.clearance) * chance.uniform(0.0, 1.0), 0.5),
    ("StartMotion", "tilt"): seldom(lambda _, scene: 0.1 * abs(scene.clearance) / scene.length, 0.2),
    ("StartMotion", "velocity"): lambda chance, scene: scene.bending * abs(scene.clearance) * chance.uniform(-3.0, 3.0),
    ("StartMotion", "spin"): seldom(lambda _, scene: scene.bending * abs(scene.clearance) / scene.length, 0.4),
    ("StartMotion", "point"): seldom(_point),
    ("StartMotion", "displacement"): never,  # its components are those of the mesh: lift and tilt are drawn
    ("StartMotion", "rotation"): never,
    ("StartMode", "number"): one_of(3, 4),  # 1 and 2 of a free beam are rigid
    ("StartMode", "amplitude"): lambda chance, scene: 0.05 * abs(scene.clearance) * chance.uniform(-1.0, 1.0),
    ("StartMode", "probe"): one_of("p0"),  # the first one; where there is none, the table is left out
    ("StartMode", "phase"): seldom(between(0.0, 360.0)),
    ("Periodic", "periods"): one_of(1, 1, 1, 2, 3),
    ("Periodic", "tolerance"): seldom(powers(-9.0, -5.0)),
    ("Periodic", "max_iterations"): seldom(one_of(15, 60)),
    ("Periodic", "harmonics"): one_of(5, 12, 20),
    ("Periodic", "samples_per_harmonic"): one_of(8, 16, 32),
    ("Continuation", "key"): one_of("support.clearance", "contact.stiffness", "load.l1.amplitude", "load.l1.frequency"),
    ("Continuation", "low"): lambda *_: 0.0,  # put around the value of the case where that is known
    ("Continuation", "high"): lambda *_: 1.0,
    ("Continuation", "first_step"): seldom(between(0.005, 0.05)),
    ("Continuation", "longest_step"): seldom(between(0.05, 0.3)),
    ("Continuation", "max_points"): one_of(6, 60),
    ("SolverTable", "tolerance"): seldom(powers(-11.0, -8.0)),
    ("SolverTable", "memory"): seldom(one_of(0.5, 2.0), 0.1),
    ("Gates", "impact_loss"): seldom(powers(-4.0, -1.0), 0.1),
    ("Gates", "impact_growth"): seldom(powers(-4.0, -2.0), 0.1),
    ("Gates", "total_growth"): seldom(powers(-2.0, 0.0), 0.1),
    ("Gates", "total_loss"): seldom(powers(-2.0, 0.0), 0.1),
    ("Gates", "accept_energy_loss"): seldom(one_of(True, False), 0.1),
    ("Gates", "accept_energy_growth"): seldom(one_of(True, False), 0.1),
    ("Output", "history_interval"): seldom(lambda chance, scene: scene.step * chance.choice((1, 2, 3)), 0.3),
    ("Output", "smoothing_window"): seldom(lambda chance, scene: chance.choice((0.01, 0.1)) / scene.frequency, 0.1),
    ("Output", "fields_interval"): lambda chance, scene: scene.step * chance.choice((50, 100)),
    ("Output", "stress"): seldom(one_of(True, False), 0.2),
    ("Output", "points"): seldom(one_of(True, False), 0.2),
    ("Output", "checkpoint_interval"): seldom(one_of(0.0, 1.0)),
    ("Output", "wall_time"): never,
    ("Output", "keep_checkpoint"): never,  # a search for a periodic response has none
    ("Output", "keep_states"): never,
    ("Transient", "state"): seldom(lambda _, scene: str(scene.folder / EARLIER), 0.07),  # run before: `attempts`
    ("Transient", "state_time"): never,  # the run before keeps its last state alone
}
"""Rules by class of the table, or of one that it derives from, and key."""


def rule_of(table: type, key: str) -> Rule | None:
    """Return the rule of a key: that of its table or of the nearest class that this derives from."""
    return next((RULES[base.__name__, key] for base in table.__mro__ if (base.__name__, key) in RULES), None)
