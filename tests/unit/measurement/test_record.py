"""What is cut out of a record."""

import numpy as np


def test_a_window_holds_the_samples_at_its_bounds_whatever_their_rounding(drop):
    step = 1.0 / drop.sampling_rate
    first, last = 100, 5000
    for off in (-1e-6 * step, 0.0, 1e-6 * step):
        cut = drop.window(drop.time[first] + off, drop.time[last] + off)
        np.testing.assert_array_equal(cut.time, drop.time[first : last + 1])
        np.testing.assert_array_equal(cut.signals, drop.signals[first : last + 1])
    later = drop.window(drop.time[first] + 0.5 * step, drop.time[last] - 0.5 * step)
    np.testing.assert_array_equal(later.time, drop.time[first + 1 : last])
