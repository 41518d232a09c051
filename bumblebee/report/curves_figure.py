"""Learning curves: success and keypoint error against frames, base first, experts and refinements beside it."""

import pandas as pd

from bumblebee.report.figures import canvas, colour, svg_uri


def curves_figure(curves: dict[str, pd.DataFrame], title: str = "") -> str | None:
    """Image URI; None without curves.

    Args:
        curves: name -> columns frames, success, key_error [m] (rows an iteration); smoothed here over 5 % of the rows.
        title: in front of both axes' titles.
    """
    usable = {n: c for n, c in curves.items() if len(c) > 1 and {"frames", "success", "key_error"} <= set(c.columns)}
    if not usable:
        return None
    figure, (left, right) = canvas(2, height=2.9)
    for i, (name, curve) in enumerate(usable.items()):
        window = max(1, len(curve) // 20)
        smooth = curve[["success", "key_error"]].rolling(window, min_periods=1).mean()
        left.plot(curve["frames"] / 1e6, smooth["success"], color=colour(i), label=name, lw=1.6)
        right.plot(curve["frames"] / 1e6, 100 * smooth["key_error"], color=colour(i), lw=1.6)
    left.set(title=f"{title}Episodes that end well", xlabel="frames [million]", ylim=(-0.02, 1.02))
    right.set(title=f"{title}Key body error", xlabel="frames [million]", ylabel="cm")
    right.set_ylim(bottom=0)
    left.legend(fontsize=8, loc="lower right")
    return svg_uri(figure)
