"""The work that is open: a picture, its recipe with all its edits, and where it is saved."""

from __future__ import annotations

from pathlib import Path

from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.undo import DEFAULT_BUDGET, History


class Document:
    """A source picture and the recipe that warps it; knows no GL and no window.

    Args:
        picture: the pixels, never changed by the work.
        recipe: what is done to them.
        path: the recipe's or project's own file, if there is one yet.
        budget: bytes that undo may hold; see `History`.
    """

    def __init__(
        self, picture: Picture, recipe: Recipe, path: Path | None = None, budget: int = DEFAULT_BUDGET
    ) -> None:
        self.picture = picture
        self.path = path
        self.history = History(recipe, budget=budget)
        self._saved = recipe

    @property
    def recipe(self) -> Recipe:
        """The recipe as it is now."""
        return self.history.recipe

    @property
    def folder(self) -> Path:
        """Where the names of pictures in the recipe start from."""
        return self.path.parent if self.path else Path.cwd()

    @property
    def is_dirty(self) -> bool:
        """True if there is something that has not been saved."""
        return self.recipe is not self._saved and self.recipe != self._saved

    def edit(self, name: str, **parts: object) -> None:
        """Replace parts of the recipe, as one entry of the history."""
        self.history.commit(name, self.recipe.edited(**parts))

    def begin_with(self, recipe: Recipe) -> None:
        """Begin anew with another recipe, for which there is nothing to save or to undo."""
        self.history = History(recipe, budget=self.history.budget)
        self._saved = recipe

    def simulate_on(self, cells: int) -> None:
        """Let all states of the work be simulated on another grid: no edit, nothing to undo and nothing to save."""
        self.history.replace_all(lambda recipe: recipe.on_grid(cells))
        self._saved = self._saved.on_grid(cells)

    @property
    def saved_recipe(self) -> Recipe:
        """The recipe as it was saved last, or opened."""
        return self._saved

    def restore(self, history: History, saved: Recipe) -> None:
        """Go on with all the edits of a session that has ended; `saved` is what had been saved of them."""
        self.history = history
        self._saved = saved

    def saved(self, path: Path) -> None:
        """Take note that the work, as it is now, has been written to `path`."""
        self.path = path
        self._saved = self.recipe
