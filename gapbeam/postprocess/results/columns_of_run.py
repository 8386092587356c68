"""Tables of a run as columns, and its records: contact points, wear and impacts, and histories in a span of time.

Tables are points.csv, wear.csv and impacts.csv. Values of contact points are averaged over the points at one place
along the beam, or in one direction.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gapbeam.postprocess.results_errors import OptionError, ResultsError
from gapbeam.solver.schema.record_table import (
    HISTORY,
    IMPACT_COLUMNS,
    IMPACTS_FILE,
    POINT_COLUMNS,
    POINTS_FILE,
    WEAR_COLUMNS,
    WEAR_FILE,
)

LARGEST = 200_000_000  # bytes, more than a run writes
_DIGITS = 9  # of the largest place: places that differ by less count as one


@dataclass(frozen=True)
class _Table:
    """A file with rows of numbers by face.

    Attributes:
        file: Its name.
        columns: Behind the face, with their units.
        contents: Its contents, for messages.
        may_lack: Number of last cells that may be empty.
        asked: Key that makes a run write it.
    """

    file: str
    columns: Mapping[str, str]
    contents: str
    may_lack: int
    asked: str


TABLES = {
    "points": _Table(POINTS_FILE, POINT_COLUMNS, "results of contact points, one a line", 2, "`output.points = true`"),
    "wear": _Table(WEAR_FILE, WEAR_COLUMNS, "work at contact points, one a line", 4, "`[wear]` in the case"),
    "impacts": _Table(IMPACTS_FILE, IMPACT_COLUMNS, "impacts, one a line", 0, "a run in time whose faces meet"),
}


def rows_by_face(folder: Path, name: str) -> dict[str, np.ndarray]:
    """Return the rows of each face, (k, columns), in a table of TABLES.

    Cells of last columns that are empty are not-a-number. Empty where the file is not there, as in runs of earlier
    releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    table = TABLES[name]
    path, columns, filled = folder / table.file, len(table.columns), len(table.columns) - table.may_lack
    if not path.is_file():
        return {}
    found: dict[str, list[list[float]]] = {}
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError(f"{path.stat().st_size} bytes")
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            face, *cells = line.split(",")
            if len(cells) != columns:
                raise ValueError(f"the line {line[:80]!r}")
            cells[filled:] = [cell or "nan" for cell in cells[filled:]]
            found.setdefault(face, []).append([float(cell) for cell in cells])
        rows = {face: np.array(lines) for face, lines in found.items()}
        if not all(np.all(np.isfinite(one[:, :filled])) for one in rows.values()):
            raise ValueError("numbers that are not finite")
    except (OSError, ValueError) as fault:
        raise ResultsError(path, str(fault)[:200], table.contents, "repeat the run") from fault
    return rows


@dataclass(frozen=True)
class FaceMap:
    """The contact points of a face.

    Attributes:
        x: Places along the beam, (m,), m.
        angle: Directions of the walls, degrees from straight down, positive toward +y, (m,).
        area: Area that belongs to each point, (m,), m^2.
    """

    x: np.ndarray
    angle: np.ndarray
    area: np.ndarray

    @property
    def around(self) -> bool:
        """True where the face is met in several directions."""
        return bool(np.ptp(self.angle) > 0.0)

    def along(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places along the beam, m, and the mean of values of the points at each of them, by area."""
        return means_by_place(self.x, values * self.area, self.area)

    def turned(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return directions, degrees, and the mean of values of the points in each of them, by area."""
        return means_by_place(self.angle, values * self.area, self.area)


def distinct(places: Sequence[float] | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different places, ascending, and the number of its place for each point.

    Args:
        places: Places of the points, (m,), m or degrees.
    """
    scale = float(np.abs(places).max(initial=0.0)) or 1.0
    found, owners = np.unique(np.round(np.asarray(places) / scale, _DIGITS), return_inverse=True)
    return scale * found, owners


def means_by_place(places: np.ndarray, sums: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different places, ascending, and the sum per area of the points at each.

    Args:
        places: Places of the points, (m,), m or degrees.
        sums: Values of the points, (m,).
        areas: Area that belongs to each point, (m,), m^2.
    """
    found, owners = distinct(places)
    return found, np.bincount(owners, sums) / np.bincount(owners, areas)


@dataclass(frozen=True)
class PointMap(FaceMap):
    """Results at the contact points of a face, at the instants of the history records.

    Attributes:
        share: Share of time in contact, (m,).
        deepest: Largest penetration, (m,), m; negative: the smallest gap.
        impulse: Part of the impulse of the face, (m,), N s; not a number where it is not known.
        first_touch: Time of the first record in contact, (m,), s; not a number: there is none.
    """

    share: np.ndarray
    deepest: np.ndarray
    impulse: np.ndarray
    first_touch: np.ndarray

    @property
    def pressed(self) -> np.ndarray:
        """Impulse per area, (m,), N s/m^2."""
        return np.asarray(self.impulse / self.area)

    @property
    def touched(self) -> bool:
        """True where a point was in contact at some record."""
        return bool(np.any(np.isfinite(self.first_touch)))


def points_of(folder: Path) -> dict[str, PointMap]:
    """Return the points of each face; empty for runs without `output.points`, and of earlier releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    found = {}
    for face, lines in rows_by_face(folder, "points").items():
        columns = dict(zip(POINT_COLUMNS, lines.T, strict=True))
        kept = ("x", "angle", "area", "contact share", "deepest", "impulse", "first touch")
        found[face] = PointMap(*(columns[name] for name in kept))
    return found


HISTORY_TABLE = "history"


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        words: Name, with the labels of its probe, face, load and component: displacement, tip, y.
        unit: SI unit, "1" where there is none.
        values: Numbers or words, (rows,).
    """

    words: tuple[str, ...]
    unit: str
    values: np.ndarray

    @property
    def title(self) -> str:
        """The head of the column: displacement tip y (m)."""
        return " ".join(self.words) + ("" if self.unit == "1" else f" ({self.unit})")

    @property
    def variable(self) -> str:
        """A name that MATLAB takes: displacement_tip_y."""
        return "_".join("".join(sign if sign.isalnum() else "_" for sign in word) for word in self.words)

    @property
    def words_in_it(self) -> bool:
        """True where the values are words."""
        return bool(self.values.dtype.kind == "U")


def columns_of_table(folder: Path, name: str) -> list[Column]:
    """Return a table of a run as columns: the face, then its values; unknown cells are NaN.

    Args:
        folder: Folder of the results.
        name: "points", "wear" or "impacts".

    Raises:
        OptionError: There is no such table, or the run did not write it.
        ResultsError: The file cannot be read.
    """
    if name not in TABLES:
        raise OptionError(f"no table {name!r}; expected one of {HISTORY_TABLE}, {', '.join(TABLES)}")
    table = TABLES[name]
    rows = rows_by_face(folder, name)
    if not rows:
        raise OptionError(f"{folder} has no {table.file} with rows; it takes {table.asked}")
    faces = np.repeat(list(rows), [len(one) for one in rows.values()])
    numbers = np.concatenate(list(rows.values()))
    head = dict(re.findall(r"(\w+) \(([^)]+)\)", (folder / table.file).read_text("utf-8").partition("\n")[0]))
    behind = [
        Column((title,), head.get(title, unit) or "1", values)
        for (title, unit), values in zip(table.columns.items(), numbers.T, strict=True)
    ]
    return [Column(("face",), "1", faces), *behind]


@dataclass(frozen=True)
class WearMap(FaceMap):
    """Wear at the contact points of a face.

    Attributes:
        rate: Work rate of each point, (m,), W.
        depth_rate: Depth rate of each point by itself, (m,), m/s; None: no coefficient is known.
    """

    rate: np.ndarray
    depth_rate: np.ndarray | None

    @property
    def density(self) -> np.ndarray:
        """Work rate per area, (m,), W/m^2."""
        return np.asarray(self.rate / self.area)

    @property
    def unevenness(self) -> float:
        """Largest work rate per area over the mean of the face; 0 where nothing slides."""
        mean = float(self.rate.sum() / self.area.sum())
        return float(self.density.max()) / mean if mean > 0.0 else 0.0


def wear_of(folder: Path) -> dict[str, WearMap]:
    """Return the map of each face; empty for runs without [wear], and of earlier releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    maps = {}
    for face, found in rows_by_face(folder, "wear").items():
        columns = dict(zip(WEAR_COLUMNS, found.T, strict=True))
        depth_rate = columns["depth rate"]
        known = None if np.any(np.isnan(depth_rate)) else depth_rate
        maps[face] = WearMap(columns["x"], columns["angle"], columns["area"], columns["work rate"], known)
    return maps


def impacts_of(folder: Path) -> dict[str, np.ndarray]:
    """Return the impacts of each face that met any: (k, 5).

    The columns are closing time, s, approach speed, m/s, impulse, N s, duration, s, and how many impacts a row stands
    for. Empty for runs of earlier releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    return rows_by_face(folder, "impacts")


def as_history(records: Mapping[str, np.ndarray], labels: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """Return records as a data set with the dimensions and units of `Results.history`.

    Args:
        records: Values by name, the times as "time", (times, ...).
        labels: Names along probe, component, face, load and tangent.
    """
    variables = {
        record.name: (record.dims, records[record.name], {"units": record.unit})
        for record in HISTORY
        if record.name in records
    }
    coordinates: dict[str, np.ndarray] = {"time": records["time"]}
    coordinates |= {name: np.array(list(names), dtype=object) for name, names in labels.items() if names}
    return xr.Dataset(variables, coordinates)


_ALIKE = 3  # suggestions for a name that is not there


def chosen_records(
    history: xr.Dataset, records: Sequence[str] = (), begin: float | None = None, end: float | None = None
) -> xr.Dataset:
    """Return the records asked for, in the time asked for.

    Args:
        history: History of a run.
        records: Names of records; empty: all.
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.

    Raises:
        OptionError: A record that the run does not have, or a time span without records.
    """
    unknown = [name for name in records if name not in history.data_vars]
    if unknown:
        known = sorted(map(str, history.data_vars))
        near = get_close_matches(unknown[0], known, _ALIKE) or known
        raise OptionError(f"the run has no record {unknown[0]!r}; expected one of: {', '.join(near)}")
    if begin is not None and end is not None and begin > end:
        raise OptionError(
            f"a span of time from {begin:g} to {end:g} s; expected an end behind the begin; try from {end:g} to "
            f"{begin:g} s"
        )
    chosen = history[list(records)].assign_coords(history.coords) if records else history
    kept = chosen.sel(time=slice(begin, end))
    if kept.sizes["time"] == 0:
        times = history["time"].values
        span = f"records from {times[0]:g} to {times[-1]:g} s" if len(times) else "no records"
        first, last = ("the start" if begin is None else f"{begin:g} s"), ("the end" if end is None else f"{end:g} s")
        raise OptionError(f"there is no record from {first} to {last}; the run has {span}")
    return kept


class RunFace(NamedTuple):
    """A face of a support.

    Attributes:
        face: Its name.
        below: Whether it is a plane below the beam.
        gap: Distance from the undeformed beam, or from the beam in the middle of a hole, m.
        around: Whether it is a hole around the beam.
        offset: Height of the middle of a hole above the axis of the beam, m.
        lateral: Distance from that axis toward +y, m.
        tilt: Rise of the face along the beam, no unit.
        angles: Directions in which `recesses` hold, degrees from straight down, positive toward +y; none: all alike.
        recesses: Distance of the wall beyond the gap there, m.
        flat: Whether it is made of flat walls in these directions, and not of a curve through them.
        moves: Change of gap, offset and lateral by a unit of each of the `wall_motions`, by name.
    """

    face: str
    below: bool
    gap: float
    around: bool = False
    offset: float = 0.0
    lateral: float = 0.0
    tilt: float = 0.0
    angles: tuple[float, ...] = ()
    recesses: tuple[float, ...] = ()
    flat: bool = False
    moves: tuple[tuple[str, tuple[float, float, float]], ...] = ()

    def moved(self, motions: Mapping[str, float]) -> RunFace:
        """Return the face where motions of walls have brought it.

        Args:
            motions: Motions of walls by name, m.
        """
        gap, offset, lateral = self.gap, self.offset, self.lateral
        for name, change in self.moves:
            by = motions.get(name, 0.0)
            gap, offset, lateral = gap + by * change[0], offset + by * change[1], lateral + by * change[2]
        return self._replace(gap=gap, offset=offset, lateral=lateral)

    def walls(self, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Return directions and distances of planes around the axis of the beam that bound its motion.

        Args:
            scale: Enlarges the distances.

        Returns:
            Angles, degrees, and distances from the middle of the hole, m; of a curve, at every degree.
        """
        if self.flat:
            return np.array(self.angles), scale * (self.gap + np.array(self.recesses))
        turns = np.arange(-180.0, 180.0)
        recess = np.interp(turns, self.angles, self.recesses, period=360.0) if self.angles else np.zeros(len(turns))
        return turns, scale * (self.gap + recess)


class RunSupport(NamedTuple):
    """A support.

    Attributes:
        name: Name in the case.
        start: Start along the beam, m.
        end: End along the beam, m.
        clearance: m.
        faces: Faces that the beam touches.
        thickness: Thickness of the beam there, m; None: the same all along the beam.
    """

    name: str
    start: float
    end: float
    clearance: float
    faces: tuple[RunFace, ...]
    thickness: float | None = None


def supports_of(summary: Mapping[str, Any], case: Mapping[str, Any]) -> tuple[RunSupport, ...]:
    """Return the supports of a run in their order along the beam.

    Args:
        summary: The summary of the run; runs of earlier versions do not describe their supports there.
        case: The case as run, whose table [support] stands in for it.
    """
    described = (summary.get("model") or {}).get("supports")
    if described is None:
        table = case.get("support") or {}
        clearance = float(table.get("clearance", 0.0))
        faces = (RunFace("base", True, 0.0), RunFace("gland", False, clearance))
        return (RunSupport("support", 0.0, float(table.get("length", 0.0)), clearance, faces),)
    return tuple(
        RunSupport(
            str(one["name"]),
            float(one["from"]),
            float(one["to"]),
            float(one["clearance"]),
            tuple(map(_face, one["faces"])),
            float(one["thickness"]) if "thickness" in one else None,
        )
        for one in described
    )


def _face(described: Mapping[str, Any]) -> RunFace:
    side = described["side"]
    offset, lateral, tilt = (float(described.get(key, 0.0)) for key in ("offset", "lateral", "tilt"))
    angles, recesses = (tuple(map(float, described.get(key, ()))) for key in ("angles", "recesses"))
    found = (described.get("moves") or {}).items()
    moves = tuple((str(name), (float(gap), float(up), float(aside))) for name, (gap, up, aside) in found)
    return RunFace(
        str(described["name"]), side == "below", float(described["gap"]), side == "around",
        offset, lateral, tilt, angles, recesses, bool(described.get("flat")), moves,
    )  # fmt: skip


def wall_motion_series(history: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the motions of walls at the records, (times,), m, by name.

    Loads move walls under their names, the bodies of supports under NAME.AXIS.
    """
    found = dict[str, np.ndarray]()
    if "wall_motion" in history:
        moved = history["wall_motion"]
        found |= {str(name): moved.sel(moving=name).values for name in moved["moving"].values}
    if "support_displacement" in history:
        bodies = history["support_displacement"]
        for name in bodies["support_body"].values:
            for axis in bodies["support_axis"].values:
                found[f"{name}.{axis}"] = bodies.sel(support_body=name, support_axis=axis).values
    return found


def wall_motions(history: xr.Dataset, time: float) -> dict[str, float]:
    """Return the motions of walls at a time, linear between records, m, by name."""
    times = history["time"].values
    return {name: float(np.interp(time, times, moved)) for name, moved in wall_motion_series(history).items()}
