"""Pictures and a film of the deformed beam in its support."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from gapbeam.postprocess.figures.shape_figures import film_frames, film_times, shape_picture, shapes_of
from gapbeam.postprocess.results.results import Given, Results, folder_of, open_results
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.scene.film import RenderError, write_film
from gapbeam.postprocess.scene.plane_view import Studio
from gapbeam.postprocess.scene.surface_color import STRESSES
from gapbeam.solver.scene.argument_checks import checked

FOLDER = "pictures"
LONGEST_FILM = 300
SMALLEST = 200

__all__ = ["RenderError", "render"]


@checked
def render(
    results: Given,
    output: str | PathLike[str] | None = None,
    scale: Literal["auto"] | float = "auto",
    film: bool = True,
    frames: int | None = None,
    size: tuple[int, int] = (1600, 900),
    frames_per_second: float = 20.0,
    progress: Callable[[int, int], None] | None = None,
    stress: Literal["axial", "von-mises"] | None = None,
) -> list[Path]:
    """Draw the beam at its largest contact force and at its largest tip displacement, and a film.

    Of structures in space, the picture shows their largest displacement.

    In every view displacement and clearance are enlarged by the same factor, which is written on the picture:
    faces meet in the picture where they meet in the computation.

    Args:
        results: Results folder of a run, or what `run` returned.
        output: Folder; default: pictures in the results folder.
        scale: Enlargement of displacements; "auto": a round factor for each view, one that shows the motion of the
            whole beam, one that shows the gap in the support.
        film: Also make a film.
        frames: The last frames of the run; None: 300.
        size: Width and height in pixels.
        frames_per_second: Speed of the film.
        progress: Called with the number of frames that are drawn, and of all.
        stress: Color the beam by this stress; None: by the contact pressure on its faces.

    Returns:
        The files written: two pictures, and the film (mp4, or GIF where there is no ffmpeg).

    Raises:
        ResultsError: The results cannot be read, or have no such stress.
        RenderError: No solid can be drawn off-screen here, or there are no fields.
        OptionError: A scale, size, speed or number of frames out of range, or an unknown stress.
        UserError: The folder cannot be written.
    """
    _check(scale, frames, size, frames_per_second)
    if stress is not None and stress not in STRESSES:
        raise OptionError(f"stress {stress!r}: expected one of {', '.join(STRESSES)}, or None")
    colored = None if stress is None else STRESSES[stress]
    speed = frames_per_second
    run = open_results(folder_of(results))
    if run.summary.get("scene"):
        if stress is not None:
            raise OptionError("stress: structures are drawn as lines, without stress; leave it out")
        target = Path(output) if output is not None else run.folder / FOLDER
        return _of_structures(run, target, scale, film, frames or LONGEST_FILM, size, speed, progress)
    with run.fields() as fields:
        if len(fields) == 0:
            raise RenderError(f"{fields.path} holds no times yet")
        target = Path(output) if output is not None else run.folder / FOLDER
        chosen = range(max(0, len(fields) - (frames or LONGEST_FILM)), len(fields))
        film = film and len(chosen) > 1
        paths = []
        with closing(Studio(run, fields, scale, size, speed if film else 0.0, colored)) as studio:
            target.mkdir(parents=True, exist_ok=True)
            for name, (index, remark) in studio.moments().items():
                paths.append(target / f"{name}.png")
                Image.fromarray(studio.draw(index, remark)).convert("RGB").save(paths[-1])
            if film:
                studio.hurry()
                drawn = (studio.draw(index) for index in chosen)
                paths.append(write_film(target / "film", _counted(drawn, len(chosen), progress), speed))
    return paths


def _of_structures(
    run: Results, target: Path, scale: Literal["auto"] | float, film: bool, most: int, size: tuple[int, int],
    speed: float, progress: Callable[[int, int], None] | None,
) -> list[Path]:  # fmt: skip
    """Draw the shapes of structures in space."""
    shapes, times = shapes_of(run.folder), film_times(run.folder)
    if shapes is None or not len(times):
        raise RenderError(
            f"{run.folder} has no shapes: no structure has nodes with a place in space: masses, beams and bars have "
            "none. To try: add `place` to matrices with nodes, or draw the records by `gapbeam plot`"
        )
    target.mkdir(parents=True, exist_ok=True)
    path = target / "shapes.png"
    path.write_bytes(shape_picture(shapes))
    chosen = range(max(0, len(times) - most), len(times))
    if not film or len(chosen) < 2:
        return [path]
    frames = film_frames(run.folder, run.history, chosen, size, None if scale == "auto" else scale)
    return [path, write_film(target / "film", _counted(frames, len(chosen), progress), speed)]


def _counted(
    frames: Iterator[np.ndarray], count: int, progress: Callable[[int, int], None] | None
) -> Iterator[np.ndarray]:
    for number, frame in enumerate(frames, start=1):
        yield frame
        if progress is not None:
            progress(number, count)


def _check(scale: Literal["auto"] | float, frames: int | None, size: tuple[int, int], frames_per_second: float) -> None:
    if scale != "auto" and not (np.isfinite(scale) and scale > 0.0):
        raise OptionError(f'scale {scale}: expected "auto" or a positive number')
    if frames is not None and frames < 1:
        raise OptionError(f"frames {frames}: expected at least 1")
    check_size(size)
    if not frames_per_second > 0.0:
        raise OptionError(f"frames per second {frames_per_second}: expected a positive number")


def check_size(size: tuple[int, int]) -> None:
    """Refuse pictures that are too small.

    Raises:
        OptionError: The pictures are too small.
    """
    if min(size) < SMALLEST:
        raise OptionError(f"size {size[0]} x {size[1]}: expected at least {SMALLEST} pixels either way")
