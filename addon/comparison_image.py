"""The picture of a comparison, as an image of Blender's that is not packed, and the editors that show it."""

import bpy
import numpy as np

NAME = "BLE Unwrap | Smart UV Project"  # what is left and what is right in it


class _Shown:
    picture = None  # (h, w, 3), the lowest row first; kept when the image is gone, since undo may bring that back
    name, uid = "", 0  # of the image
    editors = []  # (area, name of the image that it showed before)


def put_up(context, picture):
    """Makes the image and shows it in an Image Editor, else in a UV Editor while nothing is edited there."""
    take_away(context)
    height, width = picture.shape[:2]
    image = bpy.data.images.new(NAME, width, height, alpha=False)
    _Shown.picture, _Shown.name, _Shown.uid = picture, image.name, image.session_uid
    _fill(image)
    _show_in_editor(context, image)


def take_away(context):
    """Removes the image; editors that show it show again what they did before."""
    restore_editors(context)
    if (image := _image()) is not None:
        bpy.data.images.remove(image)


def forget():
    """Another file is loaded: there is nothing of it in that."""
    _Shown.picture, _Shown.name, _Shown.uid, _Shown.editors = None, "", 0, []


def _image():
    """The image, or None where it is gone; another one may have its name by now."""
    image = bpy.data.images.get(_Shown.name) if _Shown.name else None
    return image if image is not None and image.session_uid == _Shown.uid else None


def draw_again(context):
    """After undo or redo: Blender may have brought the image back, but without its pixels, and shows it nowhere."""
    image = _image()
    if image is not None and tuple(image.size) == _Shown.picture.shape[1::-1]:
        _fill(image)
        if not _Shown.editors:
            _show_in_editor(context, image)


def restore_editors(context):
    """Lets the editors that show the image, or nothing since it is gone, show what they did before."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    for area, before in _Shown.editors:
        if area not in areas or area.type != "IMAGE_EDITOR":
            continue  # it was closed or is something else by now
        shown = area.spaces.active.image
        if shown is None or shown.session_uid == _Shown.uid:
            area.spaces.active.image = bpy.data.images.get(before) if before else None
    _Shown.editors = []


def _fill(image):
    picture = _Shown.picture
    pixels = np.ones((*picture.shape[:2], 4), np.float32)
    pixels[..., :3] = picture
    image.pixels.foreach_set(pixels.reshape(-1))
    image.update()


def _show_in_editor(context, image):
    _Shown.editors = []
    if area := _editor(context):
        before = area.spaces.active.image
        _Shown.editors = [(area, before.name if before else "")]
        area.spaces.active.image = image


def _editor(context):
    """The editor that the picture is shown in, or None. Over it a UV Editor would draw the map that is edited."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    editors = [area for area in areas if area.type == "IMAGE_EDITOR"]
    free = [area for area in editors if area.ui_type != "UV" or context.mode != "EDIT_MESH"]
    return min(free, key=lambda area: area.ui_type == "UV", default=None)
