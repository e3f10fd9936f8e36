"""Frames of a figure as an animated GIF."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

COLORS = 40


def frame(drawn: Any) -> Any:
    """What the figure's canvas shows now."""
    from PIL import Image

    return Image.fromarray(np.asarray(drawn.canvas.buffer_rgba())[..., :3].copy())


def save(path: Path, frames: list[Any], frame_s: float, last_s: float) -> None:
    """One palette for all: a frame then costs only what moved. The last one stays for last_s."""
    from PIL import Image

    palette = frames[-1].quantize(COLORS, method=Image.Quantize.MAXCOVERAGE, dither=0)
    drawn = [picture.quantize(palette=palette, dither=0) for picture in frames]
    lasts_ms = [round(1e3 * frame_s)] * (len(drawn) - 1) + [round(1e3 * last_s)]
    drawn[0].save(
        path, format="GIF", save_all=True, append_images=drawn[1:], duration=lasts_ms, loop=0,
        optimize=False,
    )  # fmt: skip
