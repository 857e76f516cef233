"""The sheets that the figures are laid out on."""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.append(str(Path(__file__).parents[1] / "eval"))

from figures import legend, small
from pictures.sheet import blank, sheet

from jaxplan.pictures import painter


def test_panels_stand_in_rows_with_room_for_words():
    panels = [[blank("a")] * 3, [blank("b")] * 3]
    captions = [["one", "two", "a caption that is longer than its panel"]] * 2
    page = np.asarray(sheet(panels, captions, legend(), ["x", "y", "z"], width=200))
    assert page.shape[1] == 4 * 10 + 3 * 200
    white = (page == 255).all(-1)
    assert white[:, :10].all(), "a margin on the left"
    assert white[:, -10:].all(), "captions end with their panels"
    grey = (page == 235).all(-1)
    assert grey[:, 20:200].any(1).sum() == 2 * 150, "two rows of panels"


def test_few_pixels_of_a_mark_keep_its_color():
    noise = np.random.default_rng(0).integers(0, 200, (300, 400, 3), np.uint8)
    for k, color in enumerate(painter.MARKS):
        noise[10, 10 + k] = color
    page = np.asarray(small(Image.fromarray(noise)).convert("RGB"))
    for k, color in enumerate(painter.MARKS):
        assert tuple(page[10, 10 + k]) == color
