"""Learned proposals: each `draw` gives segments for a batch of planning problems."""

from jaxplan.samplers import diffusion as diffusion
