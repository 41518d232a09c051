"""Learning curves: success and keypoint error against frames, base first, experts and refinements beside it."""

import pandas as pd
from matplotlib.ticker import MaxNLocator

from bumblebee.report.figures import canvas, colour, legend_below, svg_uri

_DASHES = ("-", "--", ":", "-.")
_MEASURES = {
    "success": ("episodes that end well [%]", 100.0),
    "key_error": ("key body error [cm]", 100.0),
}


def curves_figures(curves: dict[str, pd.DataFrame]) -> dict[str, str]:
    """Image URIs by measure (`success`, `key_error`); empty without curves.

    Args:
        curves: name -> columns frames, success, key_error [m] (rows an iteration); smoothed here over 5 % of the rows.
    """
    usable = {n: c for n, c in curves.items() if len(c) > 1 and {"frames", *_MEASURES} <= set(c.columns)}
    seen = {measure: {n: c for n, c in usable.items() if c[measure].notna().any()} for measure in _MEASURES}
    return {measure: _figure(found, measure) for measure, found in seen.items() if found}


def _figure(curves: dict[str, pd.DataFrame], measure: str) -> str:
    figure, axis = canvas(height=2.5)
    policies = list(dict.fromkeys(_policy(name) for name in curves))
    rounds = list(dict.fromkeys(name.removeprefix(_policy(name)) for name in curves))
    scale, unit = _frames_unit(max(float(curve["frames"].max()) for curve in curves.values()))
    label, factor = _MEASURES[measure]
    for name, curve in curves.items():
        dash = _DASHES[rounds.index(name.removeprefix(_policy(name))) % len(_DASHES)]
        smooth = curve[measure].rolling(max(1, len(curve) // 20), min_periods=1).mean()
        shade = colour(policies.index(_policy(name)))
        axis.plot(curve["frames"] / scale, factor * smooth, color=shade, ls=dash, label=name, lw=1.6)
    axis.set(xlabel=f"simulated frames{unit}", ylabel=label)
    axis.xaxis.set_major_locator(MaxNLocator(5))
    if measure == "success":
        axis.set_ylim(-2, 102)
    else:
        axis.set_ylim(bottom=0)
    legend_below(figure, axis)
    return svg_uri(figure)


def _frames_unit(most: float) -> tuple[float, str]:
    """(divisor, its name) so that ticks are short."""
    return (1e6, " [million]") if most >= 1e6 else (1e3, " [thousand]") if most >= 1e3 else (1.0, "")


def _policy(name: str) -> str:
    """`expert-c0 r1` -> `expert-c0`: the same colour in every round, another dash."""
    return name.split(" r")[0]
