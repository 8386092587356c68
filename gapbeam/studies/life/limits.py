"""Lives of faces that end at different depths: they are marched as shares of their limits."""

from __future__ import annotations

from dataclasses import replace

from gapbeam.studies.life.worn_march import Array, Blocks, DepthRates, RateAt, Worn, WornState, wear_down


def wear_to_limits(rate_at: RateAt, limits: Array, blocks: Blocks) -> Worn:
    """March faces from no wear to the limit of the first, as `wear_down` does for one limit.

    A depth over its limit is 1 where the life of the face ends; so is the limit of `wear_down` here.

    Args:
        rate_at: What gives the rates, m/s, at depths in m.
        limits: Depth at which the life of each face ends, (faces,), m.
        blocks: How; its limit is 1.
    """
    worn = wear_down(lambda shares, number: _times(rate_at(shares * limits, number), 1.0 / limits), len(limits), blocks)
    return replace(worn, states=tuple(_in_meters(state, limits) for state in worn.states))


def _in_meters(state: WornState, limits: Array) -> WornState:
    return WornState(state.time, state.depths * limits, _times(state.rates, limits), state.errors * limits)


def _times(rates: DepthRates, factors: Array) -> DepthRates:
    return DepthRates(rates.values * factors, rates.low * factors, rates.high * factors, rates.verdicts)
