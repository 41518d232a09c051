"""Frames as a film file: GIF and WebP by Pillow, MP4 by the machine's own ffmpeg."""

import io
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from bumblebee.errors import BadInput
from bumblebee.io.write import write_file

SUFFIXES = (".gif", ".webp", ".mp4")


def require_film(path: Path, others: tuple[str, ...] = ()) -> None:
    """Refuse a name that no film can have, before anything is drawn.

    Args:
        path: of the film.
        others: suffixes that are no film's and are fine, too.

    Raises:
        BadInput: another suffix, or .mp4 on a machine without ffmpeg.
    """
    suffix, known = path.suffix.lower(), (*SUFFIXES, *others)
    if suffix not in known:
        raise BadInput(path, f"a name that ends in {', '.join(known[:-1])} or {known[-1]}", f"{suffix[:20]!r}")
    if suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise BadInput(path, "the program ffmpeg on the PATH, which writes .mp4", "none", _other(path))


def write_film(path: Path, frames: np.ndarray, rate: float, quality: int = 80) -> int:
    """Write frames as a film that plays at real speed, a GIF or WebP over and over; one that is there is replaced.

    Args:
        path: a name that `require_film` lets pass.
        frames: (F, H, W, 3) uint8, at least one.
        rate: frames a second.
        quality: 1 to 100, of a WebP.

    Returns:
        The number of bytes.
    """
    suffix = path.suffix.lower()
    content = _mp4(path, frames, rate) if suffix == ".mp4" else _animated(frames, rate, suffix[1:], quality)
    write_file(path, content)
    return len(content)


def _animated(frames: np.ndarray, rate: float, kind: str, quality: int) -> bytes:
    images = [Image.fromarray(frame) for frame in frames]
    if kind == "gif":
        images = [image.quantize(128) for image in images]
    # A GIF counts hundredths of a second: frames differ by one, so that the film as a whole keeps real speed.
    ends = np.round(np.arange(1, len(images) + 1) * 100 / rate).astype(int)
    lengths = [int(length) * 10 for length in np.diff(ends, prepend=0)]
    buffer = io.BytesIO()
    images[0].save(buffer, kind, save_all=True, append_images=images[1:], duration=lengths, loop=0, quality=quality)
    return buffer.getvalue()


def _mp4(path: Path, frames: np.ndarray, rate: float) -> bytes:
    height, width = frames.shape[1:3]
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "film.mp4"
        given = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{rate:g}", "-i", "-"]
        done = subprocess.run(
            ["ffmpeg", "-loglevel", "error", *given, "-pix_fmt", "yuv420p", str(made)],
            input=np.ascontiguousarray(frames).tobytes(), capture_output=True, check=False,
        )  # fmt: skip
        if done.returncode or not made.exists():
            said = (done.stderr.decode("utf-8", "replace").strip().splitlines() or ["nothing"])[-1]
            raise BadInput(path, "a film from ffmpeg", said[:200], _other(path))
        return made.read_bytes()


def _other(path: Path) -> str:
    return f"A GIF needs none: --out {shlex.quote(str(path.with_suffix('.gif')))}"
