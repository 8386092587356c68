"""Caption of pictures: factors, clearance, time and speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.messages.wording import counted

_SLACK = 1.0e-9


@dataclass(frozen=True)
class Caption:
    """Texts of a sheet.

    Attributes:
        title: Upper left.
        whole: Factor of the picture of the whole beam.
        support: Factor and clearance of the picture of the support.
        forcing_frequency: Hz; None shows the time only.
        cadence: One line about the times shown; "" for none.
    """

    title: str
    whole: str
    support: str
    forcing_frequency: float | None
    cadence: str

    def clock(self, time: float) -> str:
        """Time, and forcing periods and phase since t = 0."""
        text = f"t = {1e3 * time:.2f} ms"
        if self.forcing_frequency is None:
            return text
        periods = time * self.forcing_frequency + _SLACK
        return f"{text}  =  {counted(int(periods), 'forcing period')} + {360 * (periods % 1.0):.0f}°"


def caption_of(
    title: str,
    scales: tuple[float, float],
    clearance: float,
    forcing_frequency: float | None,
    times: np.ndarray,
    frames_per_second: float,
    slides: bool = False,
) -> Caption:
    """Write the texts.

    Args:
        title: Title of the case.
        scales: Factors of the pictures of the whole beam and of the support.
        clearance: m.
        forcing_frequency: Hz, or None.
        times: Times of the frames, s.
        frames_per_second: Speed of the film; 0 for no film.
        slides: Whether the beam moves along itself by so much that a picture shows that it is not enlarged.
    """
    along = "; along the beam × 1" if slides else ""
    return Caption(
        title=title,
        whole=f"displacement × {scales[0]:g}, clearance × {scales[0]:g}{along}",
        support=f"displacement × {scales[1]:g}, clearance ({1e3 * clearance:.4g} mm) × {scales[1]:g}",
        forcing_frequency=forcing_frequency,
        cadence=_cadence(times, forcing_frequency, frames_per_second),
    )


def _cadence(times: np.ndarray, forcing_frequency: float | None, frames_per_second: float) -> str:
    if times.size < 2:
        return ""
    interval = float(np.median(np.diff(times)))
    text = f"a field every {1e3 * interval:.3g} ms"
    if forcing_frequency is not None:
        text += f", {1 / (interval * forcing_frequency):.3g} in a forcing period"
    if frames_per_second > 0.0:
        slower = 1.0 / (frames_per_second * interval)
        text += (
            f"; the film is {slower:.3g} times slower"
            if slower >= 1.0
            else f"; the film is {1 / slower:.3g} times faster"
        )
    return text
