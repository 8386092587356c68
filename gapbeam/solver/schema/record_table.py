"""Everything a run writes: names, units, dimensions and meaning, in one place.

Both the writers in `run.output` and the readers in `postprocess` take names and units from here, so that a
record means the same on both sides.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path

FORMAT_VERSION = 1

CASE_FILE = "case.toml"
HISTORY_FILE = "history.h5"
FIELDS_FILE = "fields.xdmf"
FIELDS_DATA_FILE = "fields.h5"
SUMMARY_FILE = "summary.json"
SMOOTHING_WINDOW = "smoothing_window"  # attribute of a history, s
LOG_FILE = "run.log"
PROGRESS_FILE = "progress.json"
FIELD_FOLDER = "fields"
HISTORY_FOLDER = "history"
CHECKPOINT_FOLDER = "checkpoint"
CHECKPOINTS = "step-*.checkpoint"
KEPT_MODEL = "model.checkpoint"
LOCK_FILE = "run.lock"
CURVE_FILE = "curve.json"
IMPACTS_FILE = "impacts.csv"
SHAPES_FILE = "shapes.json"
SHAPES_FIELDS_FILE = "shapes.xdmf"
SHAPES_DATA_FILE = "shapes.h5"
WEAR_FILE = "wear.csv"
POINTS_FILE = "points.csv"
CURVE_TABLE_FILE = "curve.csv"

KEY_OF_MANY_PARTS = re.compile(r"(?:[\w\"'-]{1,200}[ \t]{0,9}\.[ \t]{0,9}){50}")
"""Key of too many parts for any case: tomllib takes memory as the square of their number."""

COMPONENTS = {2: ("x", "y"), 3: ("x", "y", "z")}
TANGENTS = {2: ("x",), 3: ("x", "y")}
SLIP_MODES = ("impact", "sliding", "sticking")
"""The parts of the work of sliding, see `gapbeam.solver.system.slip_modes`."""

WEAR_COLUMNS = {
    "x": "m", "y": "m", "angle": "deg", "area": "m^2", "work": "J", **dict.fromkeys(SLIP_MODES, "J"),
    "work rate": "W", "depth rate": "m/s", "settled rate": "W", "low": "W", "high": "W",
}  # fmt: skip
"""Columns of `WEAR_FILE` behind the face, with their units; cells of the last four may be empty."""

IMPACT_COLUMNS = {"time": "s", "approach_speed": "m/s", "impulse": "N s", "duration": "s", "stands for": ""}
"""Columns of `IMPACTS_FILE` behind the face, with their units."""

POINT_COLUMNS = {
    "x": "m", "y": "m", "angle": "deg", "area": "m^2", "contact share": "", "deepest": "m", "impulse": "N s",
    "first touch": "s",
}  # fmt: skip
"""Columns of `POINTS_FILE` behind the face, with their units; cells of the last two may be empty."""


@dataclass(frozen=True)
class HistoryVariable:
    """One variable of `history.h5`.

    Attributes:
        name: Name of the variable.
        unit: SI unit, "1" where there is none.
        dims: Names of its dimensions; the first is always `time`.
        meaning: One line for the `long_name` attribute.
    """

    name: str
    unit: str
    dims: tuple[str, ...]
    meaning: str


OF_MOTIONS = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}
"""Units of motions; each is the derivative of the one behind it."""
OF_ROTATIONS = {
    "m": "rad", "m/s": "rad/s", "m/s^2": "rad/s^2", "N": "N m", "N s": "N m s", "N^2 s": "N^2 m^2 s",
    "N/m": "N m/rad", "N s/m": "N m s/rad",
}  # fmt: skip
"""Units of rotations and moments in records of displacements and forces."""


NUMBERED = re.compile(r"(.+) \d+")


def lives(process: object) -> bool:
    """Return whether the process that a lock names by its number lives on this machine."""
    return isinstance(process, int) and Path(f"/proc/{process}").exists()


def faces_of(contacts: Iterable[str | int]) -> dict[str, list[str | int]]:
    """Return the contacts of each face: "gland 1", "gland 2", ... are those of "gland"; others stand alone."""
    found: dict[str, list[str | int]] = {}
    for contact in contacts:
        numbered = NUMBERED.fullmatch(str(contact))
        found.setdefault(numbered[1] if numbered else str(contact), []).append(contact)
    return found


def unit_where(unit: str, turns: bool) -> str:
    """Return the SI unit of a record at a place: of one that rotates rad and N m in place of m and N."""
    return OF_ROTATIONS.get(unit, unit) if turns else unit


def unit_of_places(unit: str, places: Iterable[object], turning: Container[object]) -> str:
    """Return the SI unit of a record at several places: "N", "N m", or "N or N m" where both are among them."""
    return " or ".join(dict.fromkeys(unit_where(unit, one in turning) for one in places)) or unit


TURNING = "turning"
"""Coordinate of a history with the names of probes that are rotations, and of faces between them."""

STRUCK = "struck"
"""Coordinate of a history with the names of faces of impulses, whose forces depend on the step, and of probes of what
they strike, whose velocities jump."""

_PROBE = ("time", "probe", "component")
_FROM_SUPPORTS = ("time", "moved_probe", "component")
_GAUGE = ("time", "gauge")
_FACE = ("time", "face")
_ALONG_FACE = ("time", "face", "tangent")
_OF_BODY = ("time", "support_body", "support_axis")

HISTORY: tuple[HistoryVariable, ...] = (
    HistoryVariable("displacement", "m", _PROBE, "displacement relative to the support, from the undeformed body"),
    HistoryVariable("velocity", "m/s", _PROBE, "velocity relative to the support"),
    HistoryVariable(
        "acceleration_relative",
        "m/s^2",
        _PROBE,
        "acceleration relative to the support, mean over the interval that ends at t",
    ),
    HistoryVariable(
        "acceleration_absolute",
        "m/s^2",
        _PROBE,
        "acceleration in the inertial frame, mean over the interval that ends at t",
    ),
    HistoryVariable(
        "displacement_from_supports",
        "m",
        _FROM_SUPPORTS,
        "displacement relative to the line through the moving supports; where loads move supports only",
    ),
    HistoryVariable("velocity_from_supports", "m/s", _FROM_SUPPORTS, "velocity relative to this line, likewise"),
    HistoryVariable(
        "acceleration_from_supports",
        "m/s^2",
        _FROM_SUPPORTS,
        "acceleration relative to this line, likewise, mean over the interval that ends at t",
    ),
    HistoryVariable(
        "rotation",
        "rad",
        ("time", "turned_probe"),
        "rotation of the cross-section in the bending plane; positive with the slope of the axis",
    ),
    HistoryVariable("axial_stress", "Pa", _GAUGE, "stress along the beam at the point, positive in tension"),
    HistoryVariable("von_mises_stress", "Pa", _GAUGE, "von Mises stress at the point"),
    HistoryVariable("joint_force", "N", ("time", "joint", "translation"), "force of the joint on the beam, by motion"),
    HistoryVariable("joint_moment", "N m", ("time", "joint", "turn"), "moment of the joint on the beam, by motion"),
    HistoryVariable("contact_force", "N", _FACE, "normal contact force on the beam, positive in compression"),
    HistoryVariable(
        "contact_resultant",
        "N",
        ("time", "face", "across"),
        "resultant of the normal contact force on the beam across it; with supports around the beam only",
    ),
    HistoryVariable(
        "friction_force", "N", _ALONG_FACE, "friction force on the beam along the face; with friction only"
    ),
    HistoryVariable("contact_moment", "N m", _FACE, "moment of the contact pressure about x = 0: integral of x p"),
    HistoryVariable("contact_area", "m^2", _FACE, "area with positive pressure"),
    HistoryVariable("penetration", "m", _FACE, "largest penetration; negative: smallest gap"),
    HistoryVariable("impulse", "N s", _FACE, "contact force integrated over time since t = 0"),
    HistoryVariable("contact_time", "s", _FACE, "time in contact since t = 0"),
    HistoryVariable("closings", "1", _FACE, "how often the face has closed since t = 0"),
    HistoryVariable(
        "sliding_work",
        "J",
        ("time", "worn_face"),
        "integral of normal force times speed along the face since t = 0; with [wear] only",
    ),
    HistoryVariable(
        "work_by_mode",
        "J",
        ("time", "worn_face", "slip_mode"),
        "parts of the work of sliding: impact, sliding and sticking; with [wear] only",
    ),
    HistoryVariable("kinetic_energy", "J", ("time",), "kinetic energy relative to the support"),
    HistoryVariable("strain_energy", "J", ("time",), "elastic energy, restraint excluded"),
    HistoryVariable("restraint_energy", "J", ("time",), "energy in the weak restraint"),
    HistoryVariable("contact_energy", "J", ("time",), "potential of the contact stiffness"),
    HistoryVariable(
        "wall_motion",
        "m",
        ("time", "moving"),
        "motion of the walls of a support by each load that moves one, or change of its clearance, since t = 0",
    ),
    HistoryVariable("support_displacement", "m", _OF_BODY, "motion of a support body from where its spring is relaxed"),
    HistoryVariable("support_velocity", "m/s", _OF_BODY, "velocity of a support body"),
    HistoryVariable("support_force", "N", _OF_BODY, "force of spring and damper of a support body on the frame"),
    HistoryVariable("load_work", "J", ("time", "load"), "work of each load since t = 0"),
    HistoryVariable("structural_dissipation", "J", ("time",), "Rayleigh damping since t = 0"),
    HistoryVariable("contact_dissipation", "J", ("time",), "contact damping since t = 0"),
    HistoryVariable("friction_dissipation", "J", ("time",), "friction since t = 0"),
    HistoryVariable("algorithmic_dissipation", "J", ("time",), "loss by the scheme since t = 0; negative: created"),
    HistoryVariable("energy_residual", "J", ("time",), "what is left of the energy balance since t = 0"),
    HistoryVariable("iterations", "1", ("time",), "contact iterations in the interval that ends at t"),
    HistoryVariable("active_points", "1", _FACE, "contact points with positive pressure"),
)

FIELDS = {
    "displacement": "m",
    "velocity": "m/s",
    "contact_pressure": "Pa",
}
STRESS_FIELDS = {"axial_stress": "Pa", "von_mises_stress": "Pa"}
"""Further fields of runs that ask for them."""
VECTOR_FIELDS = ("displacement", "velocity")

STANDARD_GRAVITY = 9.80665


def history_pieces(folder: Path) -> list[tuple[int, Path]]:
    """Return the files of the history in a results folder with the number of their first record, in order.

    While a run goes on its history is `history.h5` and pieces after it. Each holds from the first record of the next
    one on nothing that counts: a run that continued from a checkpoint has written those records again.
    """
    named = [(re.fullmatch(r"([0-9]{12})\.h5", path.name), path) for path in (folder / HISTORY_FOLDER).glob("*.h5")]
    pieces = sorted((int(name[1]), path) for name, path in named if name and not path.is_symlink())
    return [(0, folder / HISTORY_FILE), *pieces]
