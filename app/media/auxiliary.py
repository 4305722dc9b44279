"""The picture that is warped, and the pictures and maps that its recipe names."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media.clip import Clip, frame_of
from app.media.displacement import check_size, cropped, folds, is_beside
from app.media.maps import read_map, telling_of
from app.media.pictures import read_picture
from app.media.project import frame_numbers, named_in
from app.model.picture import Picture
from app.model.recipe import UNNAMED, Recipe
from app.model.sampling import SOURCE


class Pictures:
    """The picture that is warped and the auxiliary pictures a recipe names, each read once.

    Args:
        source: the picture that is warped.
        folder: where relative names of auxiliary pictures start from.
        clip: the one that `source` is the first frame of.
        label: what the recipe is called that names them.
    """

    def __init__(
        self, source: Picture, folder: str | Path = ".", clip: Clip | None = None, label: str = UNNAMED
    ) -> None:
        self.source = source
        self.clip = clip
        self.folder = Path(folder)
        self.label = label
        self.notices: list[str] = [source.note] if source.note else []
        self._read: dict[str, Picture] = {}
        self._maps: dict[str, np.ndarray] = {}
        self._frame = lru_cache(2)(lambda frame: frame_of(clip, clip.start + frame) if clip else source)

    def load(self, name: str, frame: int = 0) -> Picture:
        """The picture called `name`, or the source itself; of a clip so many frames after its first.

        One whose size is not the source's is fitted to it, and a notice says so. Raises UserError if it cannot be read.
        """
        if name == SOURCE:
            return self._frame(frame) if frame else self.source
        if name not in self._read:
            with named_in(self.label, self.folder / name):
                picture = self._read[name] = read_picture(self.folder / name)
            if picture.note:
                self.notice(picture.note)
            mine, wanted = (picture.width, picture.height), (self.source.width, self.source.height)
            if mine != wanted:
                same = abs(mine[0] * wanted[1] - mine[1] * wanted[0]) <= max(mine + wanted)
                how = "scaled" if same else "stretched"
                self.notice(
                    f"{name} is {mine[0]} x {mine[1]} and the picture {wanted[0]} x {wanted[1]}: {how} to fit it"
                )
        return self._read[name]

    def load_map(self, name: str) -> np.ndarray:
        """The displacement (h, w, 2) of the warp map called `name`, in the longer sides of the source.

        Raises UserError if it cannot be read, or has other proportions than the source.
        """
        if name not in self._maps:
            size = self.source.width, self.source.height
            with named_in(self.label, self.folder / name):
                given = read_map(self.folder / name, picture=size)
            if given.forward:
                forward = f"{name} tells where each point goes"
                raise UserError(
                    f"{forward}; invert it with: fluidwarp convert --invert",
                    in_window=f"{forward}, and must tell where each comes from; export it in the other direction.",
                )
            if (nowhere := np.isnan(given.values).any(axis=2)).any():
                raise UserError(
                    f"Cannot use {name}: {int(nowhere.sum())} of its pixels are NaN, and each needs a value; "
                    "fill them where the map was made."
                )
            with telling_of(self.folder / name):
                check_size(given)
                self._maps[name] = cropped(given.fitted(*size)).values
            if is_beside(self._maps[name]):
                self.notice(f"{name} looks up nothing inside of the picture; give a map that does")
            if folded := folds(self._maps[name]):
                self.notice(f"{name} folds over itself in {folded} of its pixels")
        return self._maps[name]

    def forget(self, name: str) -> None:
        """Read a map or a picture anew when it is wanted next: its file may be another one now."""
        self._maps.pop(name, None)
        self._read.pop(name, None)

    def values(self, recipe: Recipe) -> list[np.ndarray]:
        """The pixels of all that was read so far and the values of maps, the source first, the others by name; and what
        stands for the frames of a clip that a recipe looks at.
        """
        read = [self._read[name].pixels for name in sorted(self._read)]
        maps, clip = [self._maps[name] for name in sorted(self._maps)], self.clip
        told = [clip.digest(clip.start + frame) for frame in frame_numbers(recipe)] if clip else []
        return [self.source.pixels, *read, *maps, np.frombuffer("".join(told).encode(), np.uint8)]

    def notice(self, text: str) -> None:
        """Note something the user should hear of, once."""
        if text not in self.notices:
            self.notices.append(text)
