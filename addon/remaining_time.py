"""How long a computation is going to take, from the share of its work that is done."""

EARLIEST_SECONDS = 1.0  # before that nothing can be told
EARLIEST_SHARE = 0.03
INERTIA_SECONDS = 3.0  # how slowly a forecast follows: shares rise in steps, and a forecast that jumps helps nobody


class RemainingTime:
    """A forecast that is told the share from time to time. All times are seconds of one clock."""

    def __init__(self, now):
        self._begun = self._told = now
        self._end = None

    def tell(self, share, now):
        """Says what share of the work, 0 to 1, is done."""
        elapsed = now - self._begun
        if elapsed < EARLIEST_SECONDS or share < EARLIEST_SHARE:
            return
        end = self._begun + elapsed / min(share, 1.0)
        if self._end is None:
            self._end = end
        else:
            follow = min(1.0, (now - self._told) / INERTIA_SECONDS)
            self._end += follow * (end - self._end)
        self._told = now

    def seconds(self, now):
        """What is left; None as long as that cannot be told."""
        return None if self._end is None else max(0.0, self._end - now)


def text(seconds):
    """A time that is left in words, no finer than a forecast is; empty where there is none."""
    if seconds is None:
        return ""
    if seconds < 5:
        return "a few seconds left"
    if seconds < 60:
        return f"about {5 * round(seconds / 5)} s left"
    minutes, rest = divmod(15 * round(seconds / 15), 60)
    return f"about {minutes}:{rest:02d} min left" if minutes < 10 else f"about {minutes} min left"
