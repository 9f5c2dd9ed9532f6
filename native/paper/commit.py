"""Which commit a measurement is of, in words."""

import subprocess
from pathlib import Path


def described(repository):
    """The last commit and its date; whether the files differ from it; or that there is none."""
    last = _git(repository, "log", "-1", "--format=commit %h (%cs)")
    if last is None:
        return "files that are in no git repository"
    return last if is_clean(repository) else f"{last} with changes that are not committed"


def is_clean(repository):
    """Whether all files that git knows are as the last commit has them."""
    return _git(repository, "status", "--porcelain", "--untracked-files=no") == ""


def _git(repository, *arguments):
    """What git prints; None where it fails or there is none."""
    try:
        done = subprocess.run(
            ["git", "-C", str(Path(repository)), *arguments], capture_output=True, text=True, check=False
        )
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None
