"""The page beside this file, brought up to date from one that was measured: Markdown and pictures."""

import shutil
from pathlib import Path


def refusal(*, clean, models, quick, rendered):
    """Why a measurement cannot become the page, as a sentence; None if it can."""
    if models:
        return "The page shows the generated models: leave out your own."
    if quick or not rendered:
        return "The page needs the full sizes and the renders: leave out --quick and --no-render."
    if not clean:
        return "The page names the commit that it was measured on: commit your changes, then measure."
    return None


def publish(measured, page):
    """Copies README.md and the pictures from one directory to another; pictures of an older page go."""
    measured, page = Path(measured), Path(page)
    pictures = page / "pictures"
    pictures.mkdir(exist_ok=True)
    for old in pictures.glob("*.png"):
        old.unlink()
    for picture in sorted((measured / "pictures").glob("*.png")):
        shutil.copy2(picture, pictures / picture.name)
    shutil.copy2(measured / "README.md", page / "README.md")
