"""Calls of the native module that the tests share."""

import ble_unwrap_native as native
import numpy as np

# Where the layout does not matter, the packer need not search long.
QUICK = {"texture_size": 64, "rotation": "none"}


def unwrap(*mesh, **settings):
    return native.unwrap(*mesh, **(QUICK | settings))


def submit(*mesh, **settings):
    return native.submit_unwrap(*mesh, **(QUICK | settings))


def arrays(result):
    return np.asarray(result.uv), np.asarray(result.chart)
