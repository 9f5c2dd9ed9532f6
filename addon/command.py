"""`blender --command ble_unwrap IN... -o OUT`: the batch entry of an installed add-on."""

import bpy

_handles = []


def _run(arguments):
    from . import batch

    return batch.main(arguments)


def register():
    _handles.append(bpy.utils.register_cli_command("ble_unwrap", _run))


def unregister():
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
