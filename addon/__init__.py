"""BLE Unwrap: automatic UV unwrapping with a stretch bound, and a certificate of the result."""


def register():
    from . import registration

    registration.register()


def unregister():
    from . import registration

    registration.unregister()
