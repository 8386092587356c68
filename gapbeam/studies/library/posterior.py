"""Samples of the values that fit a recording: the posterior by the synthetic likelihood of a library's estimates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from rich.table import Table
from scipy.spatial.distance import cdist
from scipy.stats import chi2, multivariate_normal, qmc

from gapbeam.postprocess.study_figures.study_axis import si_key
from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.system.operators import Array
from gapbeam.studies.library.calibrated_regression import CONFIDENCE, NEAR, OUTSIDE, Regression, fitted, kernel
from gapbeam.studies.library.estimate import features_of
from gapbeam.studies.library.recording import Recording
from gapbeam.studies.library.recording_library import Library
from gapbeam.studies.printed_results import PrintedResult, table_of

QUANTILES = (0.025, 0.25, 0.5, 0.75, 0.975)
MEMBERS = 2048
"""Most members that the likelihood is made from."""
PLACES = 4096
"""Places of the ranges, and places near the estimate, among which walkers start."""
BATCH, LONGEST = 1000, 20_000
"""Steps between two looks at the chains, and most steps."""
TIMES = 100
"""Correlation times that a chain takes at least: twice what the authors of the sampler advise."""


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Density of the estimates s of a recording, given positions u of the values in their ranges.

    s | u ~ N(m(u), scale C(u)). m is the kernel regression, by u, of the estimates that members get without themselves;
    C the mean of r r^T over members near u, by Gaussian weights, with r what m leaves of each member without itself.
    The scale puts 95 % of the members held out inside the ellipsoid of 95 %. A value that the recording does not
    determine has estimates near its mean, whatever it is: s is then as likely for all u.

    Args:
        regression: Regression of a library.
        count: Number of its values; figures come after them.

    Source: Wood (2010), Statistical inference for noisy nonlinear ecological dynamic systems, Nature 466;
        Fearnhead and Prangle (2012), Constructing summary statistics for approximate Bayesian computation.
    """

    regression: Regression
    count: int
    scale: float = field(init=False)

    def __post_init__(self) -> None:
        found = self.regression
        expected = NEAR * 2**self.count
        if len(found.values) < expected:
            raise UserError(
                f"estimate: {counted(len(found.values), 'member')} are too few for samples of "
                f"{counted(self.count, 'value')}; expected {expected} or more: march a larger library"
            )
        true, estimated = found.held[:, :, : self.count]
        r, C = self._gaussian(true, estimated)
        far = np.einsum("ni,nij,nj->n", r, np.linalg.inv(C), r)
        object.__setattr__(self, "scale", float(np.quantile(far, CONFIDENCE) / chi2(self.count).ppf(CONFIDENCE)))

    @cached_property
    def _members(self) -> tuple[Array, Array, float, Array, Array, float]:
        """Return u, mean of s, width and weights of m, r, and the reach of C."""
        some = slice(None, None, -(-len(self.regression.values) // MEMBERS))
        u = self.regression.values[some, : self.count]
        weights = self.regression.weights[some, : self.count]
        s = u - self.regression.errors[some, : self.count] * np.sign(weights)
        width, weights, r = fitted(u, s)
        reach = 0.5 * float(np.median(np.partition(cdist(u, u), NEAR, axis=1)[:, NEAR]))
        return u, s.mean(axis=0), width, weights, r, reach

    def _gaussian(self, u: Array, s: Array) -> tuple[Array, Array]:
        """Return s - m(u), (n, values), and C(u), (n, values, values)."""
        members, middle, width, weights, r, reach = self._members
        D = cdist(u, members)
        near = np.exp(-0.5 * (D / reach) ** 2)
        C = near @ np.einsum("ni,nj->nij", r, r).reshape(len(r), -1) / near.sum(axis=1, keepdims=True)
        return s - middle - kernel(D / width) @ weights, C.reshape(len(u), self.count, self.count)

    def __call__(self, u: Array, s: Array) -> Array:
        """Return the logarithm of the density of s, (values,), at positions u, (n, values), up to a constant."""
        inside = np.all((u >= 0.0) & (u <= 1.0), axis=1)
        r, C = self._gaussian(np.clip(u, 0.0, 1.0), s)
        far = np.einsum("ni,nij,nj->n", r, np.linalg.inv(C), r) / self.scale
        return np.where(inside, -0.5 * far - 0.5 * np.linalg.slogdet(C)[1], -np.inf)

    def sampled(self, s: Array, count: int, seed: int) -> tuple[Array, float]:
        """Return positions drawn from the posterior of s, (count, values), and how many independent ones they are.

        Raises:
            NotConverged: The chains do not forget their start.

        Source: Foreman-Mackey et al. (2013), emcee: The MCMC Hammer, PASP 125; Ter Braak (2006), Statistics and
            Computing 16.
        """
        from emcee import EnsembleSampler, State, moves

        d, walkers = self.count, max(32, 4 * self.count)
        draw = np.random.RandomState(seed)
        near = multivariate_normal(s, 4.0 * self.scale * self._gaussian(np.clip(s, 0.0, 1.0)[None], s)[1][0])
        places = qmc.Sobol(d, seed=np.random.default_rng(seed)).random(PLACES)
        places = np.vstack([places, near.rvs(PLACES, random_state=draw).reshape(-1, d)])
        worth = self(places, s) - np.log(1.0 + near.pdf(places))
        order = np.argsort(-worth - draw.gumbel(size=len(places)))  # as often as likely, none twice
        mixed = [(moves.DEMove(), 0.7), (moves.DEMove(gamma0=1.0), 0.3)]  # the second jumps between regions
        sampler = EnsembleSampler(walkers, d, lambda u: self(u, s), moves=mixed, vectorize=True)
        state = State(places[order[:walkers]], random_state=draw.get_state())
        for steps in range(BATCH, LONGEST + 1, BATCH):
            state = sampler.run_mcmc(state, BATCH)
            time = float(sampler.get_autocorr_time(tol=0).max())
            if TIMES * time < steps:
                break
        else:
            raise NotConverged(f"estimate: samples: chains of {LONGEST} steps have a correlation time of {time:.3g}")
        flat = sampler.get_chain(discard=steps // 5, flat=True)
        pick = np.linspace(0, len(flat) - 1, count).astype(int)
        return flat[pick], min(float(count), len(flat) / time)


@dataclass(frozen=True, repr=False, eq=False)
class Posterior(PrintedResult):
    """Samples of the values of a scene that fit a recording.

    Attributes:
        name: Name of the recording.
        samples: Samples by path, (samples,), one row of all paths for each sample.
        independent: Number of independent samples that they are worth.
        units: SI units by path, as far as they are known.
    """

    name: str
    samples: dict[str, Array]
    independent: float
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def quantiles(self) -> dict[str, tuple[float, ...]]:
        """The 2.5, 25, 50, 75 and 97.5 % quantiles by path."""
        return {path: tuple(map(float, np.quantile(one, QUANTILES))) for path, one in self.samples.items()}

    def headline(self) -> str:
        """Return medians and 95 % intervals in one line."""
        parts = [
            f"{si_key(path, self.units)} {q[2]:.4g} ({q[0]:.4g} to {q[-1]:.4g})" for path, q in self.quantiles.items()
        ]
        count = len(next(iter(self.samples.values())))
        return f"{self.name}: {counted(count, 'sample')}, {self.independent:.0f} independent: {', '.join(parts)}"

    def tables(self) -> list[Table]:
        """Return the quantiles."""
        heads = ("recording", "value", "unit", *(f"{100 * q:g} %" for q in QUANTILES))
        return [table_of(heads, ((self.name, path, self.units.get(path), *q) for path, q in self.quantiles.items()))]


def sample_rows(found: Sequence[Posterior]) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Return heads and one row for each sample, with its recording."""
    rows = [(one.name, *map(float, row)) for one in found for row in np.column_stack(list(one.samples.values()))]
    return ["recording", *found[0].samples], rows


@checked
def posterior(
    found: Library, recording: Recording, period: float | None = None, *, samples: int = 4000, seed: int = 0
) -> Posterior:
    """Draw samples of the values that fit a recording, by Bayes' rule from the distributions of the library.

    They show what an interval for each value does not: values that are determined together only, and several regions
    that fit. See `Likelihood` in gapbeam.studies.library.posterior. Figures of one's own are left out.

    Args:
        found: Result of `library` or `read_library`, with 40 members or more for each half of the ranges.
        recording: As of `estimate`.
        period: As of `estimate`.
        samples: Number of samples.
        seed: Seed of all draws.

    Raises:
        UserError: As of `estimate`; the recording lies outside of the library, or that has too few members.
        NotConverged: The chains do not forget their start.
    """
    if samples < 1:
        raise UserError(f"estimate: samples: found {samples}, expected 1 or more")
    u, _, rarity = found.regression(features_of(found, recording, period).mean(axis=0, keepdims=True))
    if rarity[0] < OUTSIDE:
        raise UserError(
            f"{recording.name}: outside of the library ({rarity[0]:.2g} of its members are as far off): no values fit, "
            "so that there are no samples"
        )
    paths = [path for path in found.paths if "." in path]
    drawn, independent = Likelihood(found.regression, len(paths)).sampled(u[0, : len(paths)], samples, seed)
    values = found.values_at(drawn)
    return Posterior(recording.name, dict(zip(paths, values.T, strict=True)), independent, found.units)
