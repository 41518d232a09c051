"""Statistics of a clip, in the columns of the paper's table 2, and the name of a cluster after them."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from sklearn.feature_extraction.text import ENGLISH_STOP_WORDS, TfidfVectorizer

from bumblebee.clustering.features import heading
from bumblebee.clustering.kinds import kinds
from bumblebee.clustering.text import FILLERS, plain_text
from bumblebee.motion.clip import Clip, displacement, velocities
from bumblebee.motion.contacts import foot_contacts
from bumblebee.robot.facts import columns, joint_names, limb
from bumblebee.robot.written import SIDES

LOWER = tuple(sorted(columns(tuple(name for side in SIDES for name in limb(side, "foot")))))
UPPER = tuple(i for i in range(len(joint_names())) if i not in LOWER)
COLUMNS = ("displacement", "z_move", "speed", "joint", "lower_joint", "upper_joint", "airborne")
MORE = ("turn", "lowest")
"""Columns of a clip that are not in the table: `kinds.kinds` goes by them beside it."""

_WORDS = {
    "speed": ("slow", "fast"),
    "displacement": ("near", "far"),
    "z_move": ("level", "bouncing"),
    "turn": ("straight", "turning"),
    "lowest": ("low", "upright"),
    "lower_joint": ("quiet-legs", "lively-legs"),
    "upper_joint": ("quiet-arms", "lively-arms"),
}
"""Words for a cluster whose mean of a statistic is less than that of others, and more."""
_NEARLY_ALL = 0.8  # of the clips with a text: a word that so many have is the captions' form, not their meaning


def clip_statistics(clip: Clip, contacts: np.ndarray | None = None) -> dict[str, float]:
    """Table 2's numbers of one clip; the paper does not define them further, these definitions are ours.

    displacement [m]: largest horizontal distance of the root from where it starts (a closed circle is not zero).
    z_move [mm]: mean height change of the root within 1/30 s.
    speed [m/s]: mean horizontal speed of the root.
    joint, lower_joint, upper_joint [rad/s]: mean absolute rate over all joints, the legs' 12, the others' 11; the
        paper's figures are means over joints too, as `joint` lies between the other two.
    airborne: share of frames without a foot on the floor (not in the paper; it tells a jump).
    turn [rad]: between the leftmost and the rightmost heading. lowest [m]: height of the root at its lowest.

    `contacts` (frames, 2) are the clip's, where they are known.
    """
    contacts = foot_contacts(clip) if contacts is None else contacts
    rates = velocities(clip)
    joint = np.abs(rates.joint_vel).mean(0)
    values = (
        displacement(clip),
        1000.0 / 30.0 * np.abs(rates.root_lin_vel_w[:, 2]).mean(),
        np.linalg.norm(rates.root_lin_vel_w[:, :2], axis=-1).mean(),
        joint.mean(),
        joint[list(LOWER)].mean(),
        joint[list(UPPER)].mean(),
        1.0 - contacts.any(-1).mean(),
        np.ptp(np.unwrap(heading(clip.root_quat))),
        clip.root_pos[:, 2].min(),
    )
    return dict(zip((*COLUMNS, *MORE), map(float, values), strict=True))


def keywords(captions: Sequence[Sequence[str]], labels: np.ndarray, k: int, count: int = 4) -> list[list[str]]:
    """The words that set each cluster's captions apart, by tf-idf with one document a cluster.

    A word counts for a cluster only where a larger share of its clips has it than of the others, and not at all where
    nearly all clips have it.

    Args:
        captions: of each clip, those that are evidence of its meaning (`bumblebee.clustering.text.evidence`).
        labels: each clip's cluster.
        k: number of clusters.
        count: most words of a cluster.
    """
    texts = [" ".join(plain_text(text) for text in own) for own in captions]
    pooled = [" ".join(texts[int(i)] for i in np.flatnonzero(labels == c)) for c in range(k)]
    stop = sorted(ENGLISH_STOP_WORDS | FILLERS)
    vectorizer = TfidfVectorizer(stop_words=stop, token_pattern=r"[A-Za-z]{3,}", sublinear_tf=True)
    try:
        weights = vectorizer.fit_transform(pooled).toarray()
    except ValueError:  # no caption holds a word that is not a stop word
        return [[] for _ in range(k)]
    told = np.array([bool(text.strip()) for text in texts])
    has = (vectorizer.transform(texts).toarray() > 0)[told]
    for c in range(k):
        weights[c] *= _marks(has, labels[told] == c)
    words = vectorizer.get_feature_names_out()
    return [[str(words[i]) for i in np.argsort(-row, kind="stable")[:count] if row[i] > 0] for row in weights]


def _marks(has: np.ndarray, own: np.ndarray) -> np.ndarray:
    """(W,) whether each word tells the cluster's clips `own` (N,) from the others, from who `has` it (N, W)."""
    if not own.any() or own.all():
        return np.zeros(has.shape[1], bool)  # nothing to be told apart from
    inside, outside = has[own].mean(0), has[~own].mean(0)
    return (inside > outside) & (has.mean(0) < _NEARLY_ALL)


def names(statistics: pd.DataFrame, labels: np.ndarray, k: int) -> list[str]:
    """A name for each cluster: the commonest kind of its clips (`kinds.RULES`), and what sets it apart from others.

    Clusters of one kind get a second word each, after the statistic in which the cluster's mean is farthest from the
    mean of the others of that kind, in standard deviations over all clips. No word is used twice.

    Args:
        statistics: one row a clip, as `clip_statistics` gives it.
        labels: (N,) each clip's cluster.
        k: number of clusters.
    """
    own = (
        pd.Series(kinds(statistics)).groupby(labels).agg(lambda of: of.mode()[0]).reindex(range(k), fill_value="empty")
    )
    values = statistics[list(_WORDS)]
    means = (values / values.std(ddof=0).replace(0.0, np.inf)).groupby(labels).mean().reindex(range(k), fill_value=0.0)
    result = own.tolist()
    for kind, alike in own.groupby(own):
        if len(alike) > 1:
            for c, word in _apart(means.loc[alike.index]).items():
                result[c] = f"{kind}-{word}"
    return result


def _apart(means: pd.DataFrame) -> dict[int, str]:
    """A word for each of some clusters, none twice, from the means of their scaled statistics."""
    off = (means - means.mean()) * len(means) / (len(means) - 1)  # from the mean of the others
    words: dict[int, str] = {}
    for (c, name), far in off.stack().sort_values(key=lambda far: -far.abs(), kind="stable").items():
        word = _WORDS[name][int(far > 0)]
        if c not in words and word not in words.values():
            words[c] = word
    left = [c for c in means.index if c not in words]
    return words | {c: str(number) for number, c in enumerate(left, 1)}
