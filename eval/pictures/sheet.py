"""Pictures side by side on one sheet, with letters, headings, captions and a legend."""

from collections.abc import Sequence
from typing import NamedTuple

from PIL import Image, ImageDraw

from jaxplan.pictures.painter import MARKS

Color = tuple[int, int, int]
INK: Color = (25, 25, 25)
PAPER: Color = (255, 255, 255)
GAP, LINE = 10, 26
"""Between panels, and height of a line of text [px]."""


class Key(NamedTuple):
    """An entry of the legend."""

    shape: str
    """dot or cross."""
    color: Color
    text: str


def sheet(
    panels: Sequence[Sequence[Image.Image]],
    captions: Sequence[Sequence[str]],
    legend: Sequence[Key] = (),
    headings: Sequence[str] = (),
    width: int = 400,
    letters: bool = True,
) -> Image.Image:
    """Rows of panels on white.

    Args:
        panels: Pictures, row by row; the first one's shape is taken for all.
        captions: A line below each.
        legend: At the foot.
        headings: A line above each column.
        width: Of a panel [px].
        letters: Whether captions begin with (a), (b), ...
    """
    first = panels[0][0]
    height = round(width * first.height / first.width)
    columns = max(len(row) for row in panels)
    top = GAP + (LINE if headings else 0)
    pitch = height + LINE + GAP
    size = (
        GAP + columns * (width + GAP),
        top + len(panels) * pitch + (LINE + GAP if legend else 0),
    )
    page = Image.new("RGB", size, PAPER)
    draw = ImageDraw.Draw(page)
    for c, heading in enumerate(headings):
        x = GAP + c * (width + GAP) + width // 2
        draw.text((x, GAP), heading, INK, font_size=20, anchor="ma")
    letter = 0
    for r, row in enumerate(panels):
        for c, panel in enumerate(row):
            x, y = GAP + c * (width + GAP), top + r * pitch
            page.paste(panel.resize((width, height), Image.Resampling.LANCZOS), (x, y))
            text = captions[r][c]
            if letters:
                text = f"({chr(ord('a') + letter)}) {text}"
                letter += 1
            draw.text((x, y + height + 4), text, INK, font_size=_fitting(text, width))
    x, y = GAP, size[1] - LINE - GAP // 2
    for key in legend:
        x = _entry(draw, x, y, key)
    return page


def blank(text: str) -> Image.Image:
    """A grey panel that says why there is no picture."""
    panel = Image.new("RGB", (640, 480), (235, 235, 235))
    ImageDraw.Draw(panel).text((320, 240), text, INK, font_size=28, anchor="mm")
    return panel


def _fitting(text: str, width: int, largest: int = 17) -> int:
    """The font size at which a line is no wider than `width` [px]."""
    draw = ImageDraw.Draw(Image.new("RGB", (1, 1)))
    size = largest
    while size > 9 and draw.textlength(text, font_size=size) > width:
        size -= 1
    return size


def _entry(draw: ImageDraw.ImageDraw, x: int, y: int, key: Key) -> int:
    """Draws an entry of the legend; returns where the next begins."""
    if key.shape == "dot":
        draw.ellipse((x, y + 4, x + 14, y + 18), key.color)
    else:
        draw.line((x, y + 11, x + 14, y + 11), key.color, 4)
        draw.line((x + 7, y + 4, x + 7, y + 18), key.color, 4)
    draw.text((x + 20, y + 2), key.text, INK, font_size=16)
    return round(x + 44 + draw.textlength(key.text, font_size=16))


def small(page: Image.Image) -> Image.Image:
    """The page in 256 colours, those of paper and marks among them: a third of the size."""
    kept = (PAPER, INK, *MARKS)
    common = 256 - len(kept)
    palette = (page.quantize(common).getpalette() or [])[: 3 * common]
    palette += [0] * (3 * common - len(palette))
    colors = Image.new("P", (1, 1))
    colors.putpalette(palette + [c for color in kept for c in color])
    return page.quantize(palette=colors, dither=Image.Dither.NONE)
