"""Seed ranges on command lines."""


def parse_seeds(text: str) -> range:
    """`A:B` is the half-open range of seeds; `A` alone is one seed.

    Raises:
        ValueError: Not of that form, negative, or empty.
    """
    try:
        first, _, end = text.partition(":")
        seeds = range(int(first), int(end) if end else int(first) + 1)
    except ValueError:
        raise ValueError(
            f"seeds {text!r}: expected FIRST:END, for example 100000:100100"
        ) from None
    if len(seeds) == 0 or seeds.start < 0:
        raise ValueError(
            f"seeds {text!r}: the range is empty or negative; expected FIRST:END with FIRST < END"
        )
    return seeds
