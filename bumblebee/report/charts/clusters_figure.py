"""Pictures of the clustering: the latent plane, and the elbow curve with the chosen and the suggested K."""

import pandas as pd
from matplotlib.ticker import MaxNLocator

from bumblebee.report.charts.figures import INK, QUIET, canvas, colour, legend_below, svg_uri

_MARKERS = "osD^vP*X<>phd"
_MANY = 1500  # motions: more are drawn as pixels inside the picture, and smaller


def plane_figure(labels: pd.DataFrame, shares: list[float] | None) -> str:
    """Image URI of the motions in the plane of the first two principal components.

    Args:
        labels: columns cluster, x, y, split, family, one row a motion.
        shares: of the latents' variance that each of the two axes holds; None where it was not kept.
    """
    figure, axis = canvas(height=3.1)
    many = len(labels) > _MANY
    size = 6 if many else 30
    families = sorted(labels["family"].fillna("").unique())
    for i, (name, group) in enumerate(labels.groupby("cluster")):
        for j, family in enumerate(families):
            part = group[group["family"].fillna("") == family]
            for split, face in (("train", colour(i)), ("test", "none")):
                rows = part[part["split"] == split]
                marker = _MARKERS[j % len(_MARKERS)]
                axis.scatter(rows["x"], rows["y"], s=size, marker=marker, facecolors=face, edgecolors=colour(i), lw=1.2,
                             rasterized=many)  # fmt: skip
        axis.scatter([], [], color=colour(i), label=f"cluster {name}")
    axis.scatter([], [], facecolors="none", edgecolors=INK, label="held out (open)")
    if families != [""]:
        for j, family in enumerate(families):
            axis.scatter([], [], color=QUIET, marker=_MARKERS[j % len(_MARKERS)], label=family or "unknown")
    said = [f" ({100 * share:.0f} % of variance)" for share in shares] if shares else ["", ""]
    axis.set(xlabel=f"component 1{said[0]}", ylabel=f"component 2{said[1]}")
    axis.xaxis.set_major_locator(MaxNLocator(5))
    axis.yaxis.set_major_locator(MaxNLocator(5))
    legend_below(figure, axis)
    return svg_uri(figure)


def elbow_figure(elbow: pd.DataFrame, k: int, suggested: int | None) -> str:
    """Image URI.

    Args:
        elbow: columns k, within_ss.
        k: the number of clusters used.
        suggested: the elbow's own suggestion; None where there is no elbow.
    """
    figure, axis = canvas(height=3.1)
    axis.plot(elbow["k"], elbow["within_ss"], "-o", color=INK, ms=4)
    for value, said, shade, size in ((suggested, "the elbow's suggestion", QUIET, 13), (k, "used", colour(0), 9)):
        at = elbow.loc[elbow["k"] == value, "within_ss"]
        if value is not None and len(at):
            label = f"K = {value}: {said}"
            axis.plot([value], [float(at.iloc[0])], "o", ms=size, mfc="none", mec=shade, mew=2, ls="none", label=label)
    axis.set(xlabel="number of clusters K", ylabel="within-cluster sum of squares", ylim=(0, None))
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend_below(figure, axis, columns=1)
    return svg_uri(figure)
