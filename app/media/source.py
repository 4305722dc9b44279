"""Reading what is warped: a picture, or a clip of any kind."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from app.errors import UserError
from app.media.clip import Clip, coded
from app.media.formats import ENDINGS
from app.media.inputs import MAX_PIXELS
from app.media.losses import joined, lost
from app.media.numbered import stands_for_files
from app.media.pages import read_pages
from app.media.pictures import read_picture
from app.media.sequence import read_sequence
from app.media.video import read_clip
from app.model.picture import Picture

PICTURE_ENDINGS = tuple(ENDINGS)
CLIP_ENDINGS = (".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".mpg", ".mpeg", ".ts", ".mts", ".ogv", ".wmv")


@dataclass(frozen=True)
class Source:
    """What is warped: a picture, or a clip and its first frame."""

    picture: Picture
    clip: Clip | None = None


def open_source(path: Path, max_pixels: int = MAX_PIXELS, animated: bool = True) -> Source:
    """The picture or, by its ending, the clip in a file; or the clip whose frames are the files `name.%04d.png`.

    animated: whether an animation is made; if not, no more than the first of a file's or a sequence's pictures is read.

    Raises:
        UserError: if it cannot be read.
    """
    if stands_for_files(path):
        clip, picture = read_sequence(path, max_pixels)
        if animated or len(clip.files) == 1:
            return Source(picture, clip if animated else None)
        first = f"of its {len(clip.files)} frames only the first is used"
        return Source(replace(picture, note=joined(picture.note, lost(path, [first]))))
    if path.suffix.lower() not in CLIP_ENDINGS:
        picture = read_picture(path, max_pixels)
        clip = read_pages(path, picture, max_pixels) if animated else None
        return Source(picture if clip is None else replace(picture, note=clip.note), clip)
    clip = read_clip(path, max_pixels)
    with closing(clip.read_frames()) as frames:
        first = next(frames, None)
    if first is None:
        raise UserError(f"Cannot read {path}: it has no frame that can be decoded; get it again.")
    losses = [] if animated or clip.frames == 1 else ["of its frames only the first is used"]
    return Source(Picture(first, note=joined(clip.note, lost(path, losses)), chunks=coded(clip.colours)), clip)
