"""The native module, loaded, called and its exceptions translated: alone imports `ble_unwrap_native`."""

from .settings_table import ZERO_STANDS_FOR_NONE


class EngineMissing(Exception):
    """The native library cannot be loaded; the text says what to do."""


class EngineError(Exception):
    """The native library refused or failed; the text is its own."""


class EngineCancelled(Exception):
    """The computation was cancelled; nothing came of it."""


def native():
    """The native module; loaded on first use, so that the add-on registers without it."""
    try:
        import ble_unwrap_native
    except ImportError as error:
        raise EngineMissing(
            f"The native library of BLE Unwrap cannot be loaded ({error}). Install the add-on from its zip file, which "
            "holds the library for your system; for Blender as a Python module, `pip install` the wheel that "
            "`make wheel` writes"
        ) from error
    return ble_unwrap_native


def version():
    """Version of the native library, or None."""
    try:
        return getattr(native(), "__version__", None)
    except EngineMissing:
        return None


def default_settings(preset):
    """The native module's own values of a preset, in its words."""
    return dict(native().default_settings(preset.lower()))


def native_settings(settings):
    """Settings in the native module's words: enum values in lower case, bridge settings left out by the caller."""
    result = {}
    for name, value in settings.items():
        if isinstance(value, str):
            value = value.lower()
        elif name in ZERO_STANDS_FOR_NONE and value == 0:
            value = None
        elif name == "texture_size" and not isinstance(value, int):
            value = tuple(value)
        result[name] = value
    return result


def call(function):
    """What `function` makes of the native module, whose exceptions are turned into ours."""
    module = native()
    try:
        return function(module)
    except module.Cancelled as error:
        raise EngineCancelled(str(error) or "cancelled") from error
    except module.BleUnwrapError as error:
        raise EngineError(str(error)) from error
    except (TypeError, ValueError, MemoryError, RuntimeError) as error:
        raise EngineError(f"{type(error).__name__}: {error}") from error
