"""The text-motion autoencoder (paper, section "AE Clustering"; after TEMOS and TMR).

Motion and text each pass a Transformer with one learned token in front, whose output is the latent; a third
Transformer, of the motion encoder's kind, turns a latent back into motion features, one positional query a frame.
There is no KL term in the paper's loss, so the latent is a point and not a distribution.
"""

import math
from dataclasses import asdict, dataclass

import torch
from torch import Tensor, nn

from bumblebee.clustering.features import Normaliser


@dataclass(frozen=True)
class AutoencoderConfig:
    """Sizes that a checkpoint needs to be rebuilt; stored beside it as JSON."""

    motion_size: int
    """Columns of M_full."""
    target_columns: tuple[int, ...]
    """Which of them M keeps."""
    text_size: int
    """Width of the text encoder's tokens."""
    hidden: int = 64
    """Width of the Transformers."""
    layers: int = 2
    """Blocks of each Transformer."""
    heads: int = 4
    """Attention heads of each block."""
    latent: int = 32
    """Size of z."""
    dropout: float = 0.1
    """Dropout while training."""

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return asdict(self) | {"target_columns": list(self.target_columns)}


def sinusoid(length: int, width: int) -> Tensor:
    """Fixed positional encoding, (length, width); `width` is even."""
    position = torch.arange(length).unsqueeze(1)
    rate = torch.exp(torch.arange(0, width, 2) * (-math.log(10000.0) / width))
    return torch.stack([torch.sin(position * rate), torch.cos(position * rate)], -1).reshape(length, width)


def transformer(config: AutoencoderConfig) -> nn.TransformerEncoder:
    """The block stack that encoders and decoder share."""
    block = nn.TransformerEncoderLayer(
        config.hidden, config.heads, 2 * config.hidden, config.dropout, "gelu", batch_first=True, norm_first=True
    )
    return nn.TransformerEncoder(block, config.layers, nn.LayerNorm(config.hidden), enable_nested_tensor=False)


class SequenceEncoder(nn.Module):
    """A padded sequence (B, T, D) with mask (B, T) to a latent (B, Z), read off a learned token in front."""

    def __init__(self, size: int, config: AutoencoderConfig) -> None:
        super().__init__()
        self.embed = nn.Linear(size, config.hidden)
        self.token = nn.Parameter(0.02 * torch.randn(1, 1, config.hidden))
        self.blocks = transformer(config)
        self.head = nn.Linear(config.hidden, config.latent)

    def forward(self, values: Tensor, mask: Tensor) -> Tensor:
        """Latents (B, Z); values behind the mask have no influence."""
        hidden = self.embed(values) + sinusoid(values.shape[1], self.token.shape[-1]).to(values)
        hidden = torch.cat([self.token.expand(len(values), -1, -1), hidden], 1)
        padding = torch.cat([mask.new_zeros(len(mask), 1), ~mask], 1)
        return self.head(self.blocks(hidden, src_key_padding_mask=padding)[:, 0])


class SequenceDecoder(nn.Module):
    """A latent (B, Z) to a sequence (B, T, D): the latent on every frame plus that frame's positional query."""

    def __init__(self, size: int, config: AutoencoderConfig) -> None:
        super().__init__()
        self.embed = nn.Linear(config.latent, config.hidden)
        self.blocks = transformer(config)
        self.head = nn.Linear(config.hidden, size)

    def forward(self, latent: Tensor, mask: Tensor) -> Tensor:
        """Frames (B, T, D) for a latent and the mask (B, T) of the frames wanted."""
        queries = sinusoid(mask.shape[1], self.embed.out_features).to(latent)
        hidden = self.embed(latent).unsqueeze(1) + queries
        return self.head(self.blocks(hidden, src_key_padding_mask=~mask))


class TextMotionAutoencoder(nn.Module):
    """Motion encoder, text encoder and decoder around one latent; normalisation travels with the weights."""

    mean: Tensor
    std: Tensor

    def __init__(self, config: AutoencoderConfig, normaliser: Normaliser | None = None) -> None:
        super().__init__()
        self.config = config
        self.motion = SequenceEncoder(config.motion_size, config)
        self.text = SequenceEncoder(config.text_size, config)
        self.decoder = SequenceDecoder(len(config.target_columns), config)
        for name, default in (("mean", 0.0), ("std", 1.0)):
            value = getattr(normaliser, name) if normaliser else torch.full((config.motion_size,), default)
            self.register_buffer(name, torch.as_tensor(value, dtype=torch.float32))

    def encode_motion(self, features: Tensor, mask: Tensor) -> Tensor:
        """z_m (B, Z) of raw features (B, T, D)."""
        return self.motion((features - self.mean) / self.std, mask)

    def encode_text(self, tokens: Tensor, mask: Tensor) -> Tensor:
        """z_l (B, Z) of the text encoder's tokens (B, L, E)."""
        return self.text(tokens, mask)

    def decode(self, latent: Tensor, mask: Tensor) -> Tensor:
        """Normalised M_hat (B, T, D_M)."""
        return self.decoder(latent, mask)

    def target(self, features: Tensor) -> Tensor:
        """Normalised M (B, T, D_M): the columns of M_full that the paper reconstructs."""
        return ((features - self.mean) / self.std)[..., list(self.config.target_columns)]
