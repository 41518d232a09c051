"""Pictures of the clustering: the latent plane, and the elbow curve with the chosen and the suggested K."""

import pandas as pd

from bumblebee.report.figures import INK, QUIET, canvas, colour, svg_uri

_MARKERS = "osD^vP*X<>phd"


def clusters_figure(labels: pd.DataFrame, elbow: pd.DataFrame, k: int, suggested: int) -> str:
    """Image URI.

    Args:
        labels: columns cluster, x, y, split, family, one row a motion.
        elbow: columns k, within_ss.
        k: the number of clusters used.
        suggested: the elbow's own suggestion.
    """
    figure, (plane, curve) = canvas(2, height=3.6)
    families = sorted(labels["family"].fillna("").unique())
    for i, (name, group) in enumerate(labels.groupby("cluster")):
        for j, family in enumerate(families):
            part = group[group["family"].fillna("") == family]
            for split, face in (("train", colour(i)), ("test", "none")):
                rows = part[part["split"] == split]
                marker = _MARKERS[j % len(_MARKERS)]
                plane.scatter(rows["x"], rows["y"], s=34, marker=marker, facecolors=face, edgecolors=colour(i), lw=1.2)
        plane.scatter([], [], color=colour(i), label=str(name))
    if families != [""]:
        for j, family in enumerate(families):
            plane.scatter([], [], color=QUIET, marker=_MARKERS[j % len(_MARKERS)], label=family or "unknown")
    plane.legend(fontsize=7.5, ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5))
    plane.set(title="Motions in the latent plane (open: held out)", xticks=[], yticks=[])
    curve.plot(elbow["k"], elbow["within_ss"], "-o", color=INK, ms=4)
    for value, said, shade, size in ((suggested, "the elbow's suggestion", QUIET, 13), (k, "used", colour(0), 9)):
        height = float(elbow.loc[elbow["k"] == value, "within_ss"].iloc[0]) if (elbow["k"] == value).any() else None
        if height is not None:
            label = f"K = {value}: {said}"
            curve.plot([value], [height], "o", ms=size, mfc="none", mec=shade, mew=2, ls="none", label=label)
    if curve.get_legend_handles_labels()[0]:
        curve.legend(loc="upper right")
    curve.set(title="Elbow curve", xlabel="number of clusters K", ylabel="within-cluster sum of squares")
    return svg_uri(figure)
