"""Numbers in messages."""

import numpy as np


def counted(number, word):
    """A number, by thousands, and what it counts, in the plural where it is not one."""
    number = int(number or 0)
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def number_text(value):
    """A measurement with three digits, or a question mark."""
    return f"{float(value):.3f}" if value is not None and np.isfinite(value) else "?"
