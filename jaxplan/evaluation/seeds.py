"""Seed ranges on command lines."""


def parse_seeds(text: str) -> range:
    """`A:B` is the half-open range of seeds; `A` alone is one seed.

    Raises:
        ValueError: Not of that form, negative, too large, or empty.
    """
    first, colon, end = text.partition(":")
    try:
        seeds = range(int(first), int(end) if colon else int(first) + 1)
    except ValueError:
        raise ValueError(
            f"seeds {text!r}: expected FIRST:END, for example 100000:100100"
        ) from None
    if not 0 <= seeds.start < seeds.stop <= 2**31:
        raise ValueError(
            f"seeds {text!r}: expected FIRST:END with 0 <= FIRST < END <= {2**31}"
        )
    return seeds
