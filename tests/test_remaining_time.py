"""The forecast beside the progress bar."""

import importlib.util
import itertools
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent / "addon" / "remaining_time.py"
spec = importlib.util.spec_from_file_location("remaining_time", SOURCE)
remaining_time = importlib.util.module_from_spec(spec)
spec.loader.exec_module(remaining_time)


def followed(share_at, until):
    """What is forecast at each tenth of a second of a computation, by its share at a time."""
    forecast, found = remaining_time.RemainingTime(100.0), []
    for tenth in range(round(10 * until)):
        now = 0.1 * tenth
        forecast.tell(share_at(now), 100.0 + now)
        found.append((now, forecast.seconds(100.0 + now)))
    return found


def test_steady_work_is_forecast_rightly():
    found = followed(lambda now: now / 40.0, 40.0)
    assert all(left is None for now, left in found if now < 1.0), "at first nothing can be told"
    assert all(abs(left - (40.0 - now)) < 0.5 for now, left in found if now > 2.0)


def test_what_stands_still_is_not_forecast_to_be_over():
    found = dict(followed(lambda now: 0.5 if now > 1.0 else 0.04, 30.0))
    assert found[max(found)] > 20.0, "half is done after thirty seconds, so it may be thirty more"


def test_a_leap_of_the_share_moves_the_forecast_slowly():
    found = [left for now, left in followed(lambda now: 0.1 if now < 5.0 else 0.6, 8.0) if left is not None]
    steps = [abs(a - b) for a, b in itertools.pairwise(found)]
    assert max(steps) < 3.0 and found[-1] < found[len(found) // 2]


def test_words_are_no_finer_than_the_forecast():
    text = remaining_time.text
    assert text(None) == ""
    assert text(0.0) == text(4.0) == "a few seconds left"
    assert text(7.0) == "about 5 s left" and text(58.0) == "about 60 s left"
    assert text(94.0) == "about 1:30 min left" and text(119.0) == "about 2:00 min left"
    assert text(3600.0) == "about 60 min left"
