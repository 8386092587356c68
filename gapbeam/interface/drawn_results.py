"""Figures, pictures and films of results from Python: by one rank, into a place that may be written."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import ParamSpec

from gapbeam.postprocess.plot import FOLDER as FIGURES
from gapbeam.postprocess.plot import plot as draw_figures
from gapbeam.postprocess.render import FOLDER as PICTURES
from gapbeam.postprocess.render import render as draw_pictures
from gapbeam.postprocess.results.bounded_files import as_written
from gapbeam.postprocess.results.results import folder_of
from gapbeam.process.failing_ranks import refuse_ranks
from gapbeam.solver.run.output.results_folder import check_place
from gapbeam.studies.study_folder import refuse_links

P = ParamSpec("P")


def _by_one_rank(draw: Callable[P, list[Path]], usual: str) -> Callable[P, list[Path]]:
    """Return a function that draws, after refusing ranks, and a place that nothing should be written into."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> list[Path]:
        refuse_ranks(draw.__name__)
        given = signature(draw).bind(*args, **kwargs).arguments
        folder, output = folder_of(given["results"]), given.get("output")
        if output is not None:
            check_place(Path(output))
        place = folder / usual if output is None else Path(output)
        with as_written(folder, into=place):
            refuse_links(place, places=(place,) if output is None else ())
            return draw(*args, **kwargs)

    return drawn


plot = _by_one_rank(draw_figures, FIGURES)
render = _by_one_rank(draw_pictures, PICTURES)
