"""Learning curves: success and keypoint error against frames, base first, experts and refinements beside it."""

import pandas as pd

from bumblebee.report.figures import canvas, colour, svg_uri

_DASHES = ("-", "--", ":", "-.")


def curves_figure(curves: dict[str, pd.DataFrame]) -> str | None:
    """Image URI; None without curves.

    Args:
        curves: name -> columns frames, success, key_error [m] (rows an iteration); smoothed here over 5 % of the rows.
    """
    usable = {n: c for n, c in curves.items() if len(c) > 1 and {"frames", "success", "key_error"} <= set(c.columns)}
    if not usable:
        return None
    figure, (left, right) = canvas(2, height=2.9)
    families = list(dict.fromkeys(_policy(name) for name in usable))
    rounds = list(dict.fromkeys(name.removeprefix(_policy(name)) for name in usable))
    for name, curve in usable.items():
        shade = colour(families.index(_policy(name)))
        dash = _DASHES[rounds.index(name.removeprefix(_policy(name))) % len(_DASHES)]
        window = max(1, len(curve) // 20)
        smooth = curve[["success", "key_error"]].rolling(window, min_periods=1).mean()
        left.plot(curve["frames"] / 1e6, smooth["success"], color=shade, ls=dash, label=name, lw=1.6)
        right.plot(curve["frames"] / 1e6, 100 * smooth["key_error"], color=shade, ls=dash, lw=1.6)
    left.set(title="Episodes that end well", xlabel="frames [million]", ylim=(-0.02, 1.02))
    right.set(title="Key body error", xlabel="frames [million]", ylabel="cm")
    right.set_ylim(bottom=0)
    left.legend(fontsize=8, loc="best", ncols=len(rounds))
    return svg_uri(figure)


def _policy(name: str) -> str:
    """`expert-c0 r1` -> `expert-c0`: the same colour in every round, another dash."""
    return name.split(" r")[0]
