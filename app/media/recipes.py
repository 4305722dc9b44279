"""Recipes in TOML files."""

from __future__ import annotations

import os

from app.media.inputs import MOST_TEXT, read_input
from app.model.recipe import Recipe


def read_recipe(path: str | os.PathLike[str]) -> Recipe:
    """The recipe in a TOML file.

    Raises:
        UserError: if it cannot be read, or as `Recipe.parse`.
    """
    return Recipe.decode(read_input(path, "recipe", MOST_TEXT), str(path))
