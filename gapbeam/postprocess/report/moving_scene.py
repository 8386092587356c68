"""The structure in its supports as a scene that a page moves: stations along the beam, and walls around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gapbeam.postprocess.report.charts import packed, packed_shorts
from gapbeam.postprocess.results.columns_of_run import RunFace
from gapbeam.postprocess.results_errors import BlockError

_NUMBERS = 16  # of 16 bits for a place of a map: x, angle, and two triangles in digits


@dataclass(frozen=True)
class SceneBeam:
    """The beam of a scene: an outline across it, carried by the motion of stations along it.

    Attributes:
        stations: x, (s,), m, increasing.
        outline: Corners of the section, counter-clockwise, (n, 2), y and z, between -1 and 1.
        half: Half of its width and height at every station, (s, 2), m.
        middle: y and z of the middle of that box, (s, 2), m.
        lateral: Displacement of the stations along y, (frames, s), m.
        vertical: Displacement along the bending direction, (frames, s), m.
        twist: Rotation about x, (frames, s), rad.
        slide: Mean displacement along x, (frames,), m; drawn as large as it is.
        planar: Whether the model is a slice, whose width is drawn only.

    Raises:
        BlockError: Shapes that differ.
    """

    stations: np.ndarray
    outline: np.ndarray
    half: np.ndarray
    middle: np.ndarray
    lateral: np.ndarray
    vertical: np.ndarray
    twist: np.ndarray
    slide: np.ndarray
    planar: bool

    def __post_init__(self) -> None:
        expected = (len(self.slide), len(self.stations))
        for name in ("lateral", "vertical", "twist"):
            if np.shape(getattr(self, name)) != expected:
                raise BlockError(f"scene: {name} of shape {np.shape(getattr(self, name))}; expected {expected}")

    @property
    def thickness(self) -> float:
        """Largest height of the section, m."""
        return float(2.0 * self.half[:, 1].max())

    @property
    def farthest(self) -> float:
        """Largest displacement of a station across the beam, m."""
        return float(np.hypot(self.lateral, self.vertical).max(initial=0.0))


@dataclass(frozen=True)
class SceneWall:
    """A face of a support in a scene.

    Attributes:
        met: The face where the run starts.
        support: Name of its support.
        along: Start and end along the beam, m.
        bottom: Bottom of the beam there, in the bending direction, m.
        top: Top of the beam there, m.
        moved: Gap, offset and lateral in every frame, (frames, 3), m; None: it stands still.
        force: Normal contact force in every frame, (frames,), N; empty: not recorded.
    """

    met: RunFace
    support: str
    along: tuple[float, float]
    bottom: float
    top: float
    moved: np.ndarray | None = None
    force: np.ndarray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True)
class FacePressure:
    """Contact pressure on a face in the frames of a scene.

    Attributes:
        face: Its name.
        x: Places along the beam, (p,), m.
        angles: Angles from the lowest line, positive toward +y, (p,), degrees; empty on a plane, where x increases.
        triangles: Numbers of the places at the corners of triangles between them, (t, 3); none on a plane.
        pressures: Pressures in every frame, (frames, p), Pa; on a plane the largest across the beam.
    """

    face: str
    x: np.ndarray
    angles: np.ndarray
    triangles: np.ndarray
    pressures: np.ndarray


@dataclass(frozen=True)
class ContactMap:
    """Contact pressures on a face around the beam, or on the planes of a support.

    Attributes:
        support: Name of the support.
        faces: One around the beam, or planes.
    """

    support: str
    faces: tuple[FacePressure, ...]

    @property
    def around(self) -> bool:
        """True for a map over x and angle, False for curves over x."""
        return self.faces[0].angles.size > 0

    @property
    def largest(self) -> float:
        """Largest pressure of all frames, Pa."""
        return max(float(face.pressures.max(initial=0.0)) for face in self.faces)

    @property
    def size(self) -> int:
        """About how many numbers of 16 bits a page holds: places, and pressures where and when anything presses."""
        pressed = [face.pressures > 0.0 for face in self.faces]
        rows = sum(int(one.any(axis=0).sum()) * int(one.any(axis=1).sum()) for one in pressed)
        return rows + sum(_NUMBERS * len(face.x) for face in self.faces)


@dataclass(frozen=True)
class MovingScene:
    """A structure that moves in its supports; the charts of the page follow its time.

    Attributes:
        caption: Description.
        times: Times of the frames, (frames,), s.
        beam: The moving beam.
        walls: The walls around it.
        magnification: Magnification of displacements and gaps at the start.
        opening: Number of the frame that is shown first, and on paper.
        command: Command that makes the scene.
        maps: Contact pressures at the same times.
    """

    caption: str
    times: np.ndarray
    beam: SceneBeam
    walls: Sequence[SceneWall]
    magnification: float
    opening: int = 0
    command: str = ""
    maps: Sequence[ContactMap] = ()

    @property
    def moves(self) -> bool:
        """True where the scene has more than one frame."""
        return len(self.times) > 1


def scene_values(scene: MovingScene) -> dict[str, object]:
    """Return the data of a scene for the script of a page, displacements to 1/32767 of the largest."""
    beam = scene.beam
    motion = {"y": beam.lateral, "z": beam.vertical, "twist": beam.twist}
    return {
        "times": packed(scene.times),
        "stations": packed(beam.stations),
        "outline": np.round(beam.outline, 5).tolist(),
        "half": packed(beam.half),
        "middle": packed(beam.middle),
        "motion": {name: packed_shorts(values) for name, values in motion.items() if np.any(values)},
        "slide": packed(beam.slide),
        "planar": beam.planar,
        "walls": [_wall(wall) for wall in scene.walls],
        "magnification": scene.magnification,
        "opening": scene.opening,
        "maps": [[_pressure(face) for face in one.faces] for one in scene.maps],
    }


def _wall(wall: SceneWall) -> dict[str, object]:
    met = wall.met
    return {
        "name": met.face,
        "support": wall.support,
        "kind": "around" if met.around else "below" if met.below else "above",
        "along": [float(end) for end in wall.along],
        "bottom": wall.bottom,
        "top": wall.top,
        "gap": met.gap,
        "offset": met.offset,
        "lateral": met.lateral,
        "tilt": met.tilt,
        "angles": list(met.angles),
        "recesses": list(met.recesses),
        "flat": met.flat,
        "moved": None if wall.moved is None else packed(wall.moved),
        "force": packed(wall.force) if wall.force.size else None,
    }


def _pressure(face: FacePressure) -> dict[str, object]:
    """Return the pressures of a face without the zeros of frames and places where nothing ever presses."""
    pressed = face.pressures > 0.0
    frames, places = np.flatnonzero(pressed.any(axis=1)), np.flatnonzero(pressed.any(axis=0))
    return {
        "x": packed(face.x),
        "angles": packed(face.angles),
        "triangles": face.triangles.ravel().tolist(),
        "frames": frames.tolist(),
        "places": places.tolist(),
        "pressures": packed_shorts(face.pressures[np.ix_(frames, places)]),
    }
