"""The held-out pairs of text and motion, and how well the autoencoder finds one by the other."""

from collections.abc import Sequence

import numpy as np

from bumblebee.clustering.autoencoder import TextMotionAutoencoder
from bumblebee.clustering.estimates import Json
from bumblebee.clustering.material import Material
from bumblebee.clustering.retrieval import retrieval
from bumblebee.clustering.text import TokenTable
from bumblebee.clustering.train import encode_clips, encode_text


def held_out_retrieval(model: TextMotionAutoencoder, table: TokenTable, materials: Sequence[Material]) -> Json | None:
    """Retrieval over the held-out clips whose captions somebody wrote; None with fewer than two captions or windows."""
    windows = [
        (row, window, texts)
        for row, own in enumerate(materials)
        if own.held_out
        for window, texts in zip(own.windows, own.evidence, strict=True)
        if texts
    ]
    captions = sorted({text for _, _, texts in windows for text in texts})
    if min(len(captions), len(windows)) < 2:
        return None
    row_of = {text: row for row, text in enumerate(table.captions)}
    texts = encode_text(model, table, [row_of[text] for text in captions])
    motions = encode_clips(model, [[window] for _, window, _ in windows])
    pairs = np.array([[text in own for _, _, own in windows] for text in captions])
    return retrieval(texts, motions, pairs, np.array([row for row, _, _ in windows]))
