"""The file of an identification as frozen pydantic models: what is unknown, what was measured, how to search."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from gapbeam.solver.table import Name, NonNegative, Number, Positive, Switch, Table, Whole


class Unknown(Table):
    """A key of the case whose value is to be found."""

    key: str = Field(
        min_length=1,
        max_length=100,
        description="dotted key of the case, as after --set; all entries of a list of numbers get the same value",
        examples=["contact.stiffness"],
    )
    lower: Number = Field(description="least value, in the unit of the key", examples=[1e5])
    upper: Number = Field(description="largest value, in the unit of the key", examples=[1e9])
    start: Number | None = Field(
        default=None, description="where to start, in the unit of the key; default the middle of the scale"
    )
    scale: Literal["log", "linear"] = Field(default="log", description="on which values are searched and differenced")


class Average(Table):
    """A moving average over consecutive samples, each the mean over its sampling interval."""

    points: Whole = Field(ge=1, le=10_000, description="number of samples averaged", examples=[5])
    rate: Positive = Field(description="sampling rate, Hz", examples=[2000.0])


class MotionFigure(Table):
    """A figure of the motion of a probe."""

    type: Literal["motion"] = Field(description="kind of figure", examples=["motion"])
    name: Name = Field(description="name in measurements and results, different for every figure", examples=["peak"])
    probe: Name = Field(description="name of the probe", examples=["test"])
    quantity: Literal["acceleration", "velocity", "displacement"] = Field(
        default="acceleration", description="which motion"
    )
    frame: Literal["absolute", "relative"] = Field(
        default="absolute",
        description="of an acceleration: absolute, or relative to the support; the others are relative to it",
    )
    component: Literal["x", "y", "z"] | None = Field(
        default=None, description="direction; default the bending direction"
    )
    statistic: Literal["peak-to-peak", "maximum", "minimum", "rms", "harmonic"] = Field(
        default="peak-to-peak", description="what is taken of the signal in a window; rms is about the mean"
    )
    order: Whole = Field(
        default=1, ge=1, le=100, description="harmonic: number of the harmonic of the forcing frequency"
    )
    average: Average | None = Field(
        default=None, description="moving average before that, a table; default none: as recorded"
    )
    window: Whole | None = Field(
        default=None, ge=1, le=1000, description="forcing periods in a window; default 12, or a multiple of the cycle"
    )


class ForceFigure(Table):
    """A figure of the contact force on a face."""

    type: Literal["force"] = Field(description="kind of figure", examples=["force"])
    name: Name = Field(description="name in measurements and results, different for every figure", examples=["blow"])
    face: Name = Field(
        description="face of a support: base, gland, or NAME_below and NAME_above of a [[support]]", examples=["gland"]
    )
    statistic: Literal["maximum", "impulse"] = Field(
        default="maximum", description="largest force on record in a window, or the impulse in a forcing period"
    )
    window: Whole | None = Field(
        default=None, ge=1, le=1000, description="forcing periods in a window; default 12, or a multiple of the cycle"
    )


class FrequencyFigure(Table):
    """A natural frequency of small vibrations about a state of contact; nothing is marched for it."""

    type: Literal["frequency"] = Field(description="kind of figure", examples=["frequency"])
    name: Name = Field(description="name in measurements and results, different for every figure", examples=["first"])
    held: Literal["seated", "free", "closed"] = Field(
        default="seated", description="contact points that are closed: those of the static seat, none, or all"
    )
    mode: Whole = Field(default=1, ge=1, le=100, description="number of the bending mode, rigid motions left out")


Figure = Annotated[MotionFigure | ForceFigure | FrequencyFigure, Field(discriminator="type")]


class Measurement(Table):
    """A measured value."""

    figure: Name = Field(description="name of the [[figure]]", examples=["peak"])
    value: Number = Field(description="measured value, in SI units", examples=[3.27])
    set: dict[str, Any] = Field(
        default={}, description="what differs in this experiment: keys of the case and their values"
    )
    sigma: Positive | None = Field(
        default=None, description="standard error of the value, in its unit; default none: found from the misfit"
    )
    relative_sigma: Positive | None = Field(
        default=None, description="the same as a fraction of the value, no unit; default none", examples=[0.05]
    )
    use: Literal["fit", "predict"] = Field(
        default="fit", description="fit: it takes part in the search; predict: it is held out"
    )


class Search(Table):
    """How the unknowns are searched."""

    method: Literal["global", "least-squares"] = Field(
        default="global", description="differential evolution and then least squares, or least squares from starts"
    )
    residual: Literal["log10", "relative", "absolute"] = Field(
        default="log10", description="what is made small: log10(computed/measured), or the difference"
    )
    budget: Whole = Field(
        default=1000, ge=1, le=10_000_000, description="largest number of sets of values that the search tries"
    )
    seed: Whole = Field(default=0, ge=0, description="of everything random")
    starts: Whole = Field(
        default=1, ge=1, le=10_000, description="least-squares: starts; the first is that of the file, the rest spread"
    )
    difference: Positive = Field(
        default=0.01, le=0.2, description="step of finite differences, as a fraction of the range of an unknown"
    )
    tolerance: Positive | None = Field(
        default=None,
        description="largest rms of the residuals of the fit, or the exit status is 5; default none asked for",
        examples=[0.06],
    )
    confidence: Number = Field(default=0.95, gt=0, lt=1, description="of the intervals, no unit")
    coexisting: Whole = Field(
        default=2, ge=0, le=100, description="random starts of each experiment at the end: is there another response?"
    )
    profile: Switch = Field(default=True, description="spend some evaluations on the profile of the misfit")


class Identification(Table):
    """A whole identification."""

    title: str = Field("", max_length=200, description="one line that says what is identified")
    case: str = Field(
        min_length=1, description="case file, its path relative to this file", examples=["li2013-2d.toml"]
    )
    transient: NonNegative | None = Field(
        default=None, description="time before a response counts, s; default found in it"
    )
    set: dict[str, Any] = Field(
        default={}, description="what differs from the case file: keys of the case and their values"
    )
    unknown: tuple[Unknown, ...] = Field(description="keys to be found")
    figure: tuple[Figure, ...] = Field(description="what is taken of a response")
    measurement: tuple[Measurement, ...] = Field(description="measured values")
    search: Search = Search()
