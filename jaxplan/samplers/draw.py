"""One door to all learned samplers, so that who asks need not know which one it is."""

import jax

from jaxplan.config import (
    CvaeConfig,
    FewStepConfig,
    GanConfig,
    SamplerConfig,
    SegmentConfig,
)
from jaxplan.networks import Cond
from jaxplan.planning.segment import Segment
from jaxplan.samplers import diffusion, few_step, one_pass

_DRAW = {
    SamplerConfig: diffusion.draw,
    FewStepConfig: few_step.draw,
    CvaeConfig: one_pass.draw,
    GanConfig: one_pass.draw,
}


def draw(
    config: SegmentConfig, params: dict, cond: Cond, keys: jax.Array, n: int
) -> Segment:
    """`n` segments for each of P problems, in one batch.

    Un-jitted; the caller jits it with `config` and `n` static.

    Args:
        config: The network that `params` belongs to; its type says which sampler.
        params: Weights.
        cond: Conditions with leading axis P.
        keys: Typed keys [P]. Problem p's segments depend on its own key and condition only.
        n: Segments per problem.

    Returns:
        Segment with direction [P, n, 7], length [P, n] [rad], and with `tree_context` base.
    """
    return _DRAW[type(config)](config, params, cond, keys, n)


def draw_chunk(
    config: SegmentConfig,
    params: dict,
    cond: Cond,
    keys: jax.Array,
    chunk: jax.Array,
    n: int,
) -> Segment:
    """Bank number `chunk` [P] of each problem: as `draw`, with fresh noise for each number."""
    keys = jax.vmap(jax.random.fold_in)(keys, chunk)
    return draw(config, params, cond, keys, n)
