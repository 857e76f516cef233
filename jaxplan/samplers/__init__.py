"""Learned proposals: `draw` gives segments for a batch of planning problems."""

from jaxplan.samplers.draw import draw as draw
from jaxplan.samplers.draw import draw_chunk as draw_chunk
