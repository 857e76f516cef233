"""What the reliability figures promise: one list, a file for each kind of trial."""

from parts.promises import damage, inputs, kills, paths, same
from parts.promises.promise import Promise as Promise

PROMISES: tuple[Promise, ...] = (
    *paths.PROMISES,
    *inputs.PROMISES,
    *same.PROMISES,
    *kills.PROMISES,
    *damage.PROMISES,
)
