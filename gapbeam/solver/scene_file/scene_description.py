"""A file of several structures in tables: bodies, points, frequencies, contacts and the seat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import numpy as np
from rich.table import Table
from rich.text import Text

from gapbeam.solver.errors import NotConverged, UserError
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_seat import seat
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.scene_file.flow_description import flow_rows
from gapbeam.solver.scene_file.scene_reader import ReadScene
from gapbeam.solver.system.dense_operators import SparseOperators

MOST = 6
FIRST_GUESS = 1e-9  # of the mean ratio of stiffness to mass
STILL = 1e-13  # of the largest: squares below belong to rigid motions
Row = tuple[str, str, str]


@dataclass(frozen=True)
class SceneDescription:
    """Description of the run of a scene before it starts.

    Attributes:
        title: Of the file.
        sections: Rows of name, value and explanation under each heading.
        seated: Whether there is a static equilibrium under the loads at t = 0.
    """

    title: str
    sections: dict[str, tuple[Row, ...]]
    seated: bool

    def __str__(self) -> str:
        lines = [self.title]
        for heading, rows in self.sections.items():
            lines += [heading, *(f"  {name}: {value}{f' ({why})' if why else ''}" for name, value, why in rows)]
        return "\n".join(lines)

    def tables(self) -> list[Table | Text]:
        """Return the description for the terminal."""
        found: list[Table | Text] = [Text(self.title, style="bold")]
        for heading, rows in self.sections.items():
            table = Table(title=heading, title_justify="left", show_header=False)
            for row in rows:
                table.add_row(*(Text(cell) for cell in row))
            found.append(table)
        return found


def describe_scene(read: ReadScene) -> SceneDescription:
    """Describe the run of a file: structures, points, frequencies, contacts, march and seat."""
    scene, time = read.scene, read.case.time
    seated, rest = _rest(scene)
    steps = round(time.end / time.step)
    how = "sparse matrices, factored once" if scene.is_large else "all modes of the structures"
    flow = flow_rows(read)
    return SceneDescription(
        read.case.title or read.name,
        {
            "structures": tuple(_body(one) for one in scene.structures),
            "points": tuple(
                (f"{one.name}.{name}", f"{len(point.rows)} motion{'s' * (len(point.rows) > 1)}", "")
                for one in scene.structures
                for name, point in one.points.items()
            ),
            "contacts": tuple(
                (one.name, one.region.kind.name, f"{one.law.kind.name}, at {' and '.join(p.name for p in one.points)}")
                for one in scene.contacts
            ),
            "march": (
                ("steps", f"{steps} of {time.step:g} s", f"scheme {time.scheme.type}"),
                ("with", how, f"{scene.size} DOFs"),
            ),
            "seat at t = 0": rest,
            **({"flow": flow} if flow else {}),
        },
        seated,
    )


def _body(structure: Structure) -> Row:
    squares = lowest_squares(structure)
    shown = ", ".join(f"{np.sqrt(one) / (2.0 * pi):.5g}" for one in squares)
    return structure.name, f"{structure.size} DOFs", f"first frequencies {shown} Hz"


def lowest_squares(structure: Structure, most: int = MOST) -> list[float]:
    """Return the lowest squares of angular frequencies, 1/s^2, those of rigid motions as 0.

    Args:
        structure: A structure of any size.
        most: At most so many.

    Raises:
        RunError: The modes of a large structure did not converge.
    """
    if not structure.is_large:
        squares = structure.modes[0]
        return [max(float(one), 0.0) for one in squares[:most]]
    operators = SparseOperators(structure.M, structure.K)
    ratios = operators.stiffness.diagonal() / operators.mass.diagonal()
    near = FIRST_GUESS * float(ratios.mean())
    squares, _ = operators.lowest_modes(near, most, operators.factor(near, 1.0))
    return [float(one) if one > STILL * ratios.max() else 0.0 for one in squares]


def _rest(scene: Scene) -> tuple[bool, tuple[Row, ...]]:
    """Return whether there is a seat, and its contact forces, or why there is none."""
    try:
        state = seat(scene)
    except (UserError, NotConverged) as error:
        return False, (("none", str(error), ""),)
    return True, tuple(_forces(scene, state.F[:, 0])) or (("displacements", "no contacts", ""),)


def _forces(scene: Scene, forces: np.ndarray) -> Iterator[Row]:
    for one, at in zip(scene.contacts, scene.first, strict=False):
        force = forces[at : at + one.motions]
        yield one.name, f"{np.linalg.norm(force):.6g} N", "closed" if np.any(force) else "open"
