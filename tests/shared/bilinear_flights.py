"""Exact motions of x'' + 2 z x' + x + k <x - g> = F cos W t: closed forms, and times of contact by roots."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

# mypy: disable-error-code="no-untyped-def,no-untyped-call"


@numba.njit(cache=True)
def _phase(x, v, t, d, closed, z, k, g, F, W):
    """Return x, v after d within one phase: the forced motion, and the free one with its exact decay."""
    stiff = 1.0 + k * closed
    rest, real, imag = k * g * closed / stiff, stiff - W * W, 2.0 * z * W
    a, b = F * real / (real * real + imag * imag), F * imag / (real * real + imag * imag)
    w = np.sqrt(stiff - z * z)
    y = x - rest - a * np.cos(W * t) - b * np.sin(W * t)
    u = v + W * (a * np.sin(W * t) - b * np.cos(W * t))
    s, c, e = np.sin(w * d), np.cos(w * d), np.exp(-z * d)
    p = (u + z * y) / w
    t += d
    new = e * (y * c + p * s) + rest + a * np.cos(W * t) + b * np.sin(W * t)
    speed = e * ((p * w - z * y) * c - (y * w + z * p) * s) - W * (a * np.sin(W * t) - b * np.cos(W * t))
    return new, speed


@numba.njit(cache=True)
def flights(x, v, z, stiffness, g, F, W, periods, parts):
    """Return strobes (periods, 2) from (x, v) at t = 0; `parts` of a period are searched for contacts one by one."""
    found, T = np.zeros((periods, 2)), 2.0 * np.pi / W
    for n in range(periods):
        for i in range(parts):
            t, left = T * i / parts, T / parts
            while left > 0.0:
                closed = 1.0 if x > g or (x == g and v > 0.0) else 0.0
                low, high, d, y, u = 0.0, left, left, x, v
                for k in range(60):
                    y, u = _phase(x, v, t, d, closed, z, stiffness, g, F, W)
                    if (y > g) == (closed > 0.0) or y == g:
                        low = d
                        if k == 0:
                            break
                    else:
                        high = d
                    d = 0.5 * (low + high)
                x, v, t, left = y, u, t + d, left - d
                if left > 0.0:
                    x = g + (1e-15 if closed == 0.0 else -1e-15)
        found[n] = x, v
    return found


def attractors(
    starts: Any, z: float, k: float, g: float, F: float, W: float, periods: int = 500, orders: int = 8
) -> Any:
    """Return strobes of the responses of starts (n, 2), and the response of each start (-1: none within orders)."""
    responses: list[Any] = []
    which = np.full(len(starts), -1)
    for i, (x, v) in enumerate(starts):
        late = flights(x, v, z, k, g, F, W, periods, 96)[-2 * orders - 1 :]
        order = next((n for n in range(1, orders + 1) if np.abs(late[n:] - late[:-n]).max() < 1e-8), 0)
        if not order:
            continue
        orbit = late[-order:]
        for j, other in enumerate(responses):
            if len(other) == order and np.abs(other - orbit[-1]).max(axis=1).min() < 1e-5:
                which[i] = j
        if which[i] < 0:
            which[i] = len(responses)
            responses.append(orbit)
    return responses, which
