"""Write the modes of cases/scenes/clip.toml as a modal analysis exports them: a clip, and the panel that it holds.

The clip is a cantilever, the panel a strip that is pinned at both ends; Euler-Bernoulli theory in closed form, shapes
mass-normalized, with the participation in a motion of the frame.

python3 docs/tables/clip_modes.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

FOLDER = Path(__file__).resolve().parents[2] / "cases" / "scenes"
CLIP = {"young": 2.8e9, "density": 1410.0, "length": 0.06, "width": 0.01, "thickness": 0.002}
PANEL = {"young": 2.2e9, "density": 1050.0, "length": 0.2, "width": 0.04, "thickness": 0.0025}
MODES = 4
DAMPING = 0.03


def angular(number: float, of: dict[str, float]) -> float:
    """Return the angular frequency of wave number / length, rad/s."""
    radius = of["thickness"] / np.sqrt(12.0)
    return float((number / of["length"]) ** 2 * radius * np.sqrt(of["young"] / of["density"]))


def mass(of: dict[str, float]) -> float:
    """Return the mass, kg."""
    return of["density"] * of["length"] * of["width"] * of["thickness"]


def clip_modes() -> list[tuple[float, float, float]]:
    """Return angular frequency, participation and tip shape of each mode of the cantilever."""
    found = []
    for k in range(MODES):
        guess = (k + 0.5) * np.pi
        b = brentq(lambda b: np.cos(b) + 1.0 / np.cosh(b), guess - 0.5, guess + 0.5, xtol=1e-14)
        s = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))

        def shape(x: float, b: float = b, s: float = s) -> float:
            return float(np.cosh(b * x) - np.cos(b * x) - s * (np.sinh(b * x) - np.sin(b * x)))

        size = np.sqrt(mass(CLIP) * quad(lambda x: shape(x) ** 2, 0.0, 1.0)[0])
        found.append((angular(b, CLIP), mass(CLIP) * quad(shape, 0.0, 1.0)[0] / size, shape(1.0) / size))
    return found


def panel_modes() -> list[tuple[float, float, float]]:
    """Return the same of the symmetric modes of the strip, with the shape at its middle."""
    found = []
    for number in range(1, 2 * MODES, 2):
        size = np.sqrt(mass(PANEL) / 2.0)
        middle = np.sin(number * np.pi / 2.0) / size
        found.append((angular(number * np.pi, PANEL), 2.0 * mass(PANEL) / (number * np.pi) / size, middle))
    return found


def main() -> None:
    """Write clip.csv and panel.csv."""
    for name, point, modes in (("clip", "tip", clip_modes()), ("panel", "middle", panel_modes())):
        lines = [f"frequency,damping,frame,{point}"]
        lines += [f"{w / (2.0 * np.pi):.12g},{DAMPING:g},{part:.12g},{shape:.12g}" for w, part, shape in modes]
        (FOLDER / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
