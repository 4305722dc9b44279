"""The work that is open: a recipe with all its edits, and what of it is saved."""

from __future__ import annotations

from app.model.recipe import Recipe
from app.model.undo import History
from app.model.windows import Made, on_grid


class Document:
    """A recipe with all its edits, and what of it is saved; knows no file, no GL and no window."""

    def __init__(self, recipe: Recipe) -> None:
        self.history = History(recipe)
        self._saved = recipe

    @property
    def recipe(self) -> Recipe:
        """The recipe as it is now."""
        return self.history.recipe

    @property
    def is_dirty(self) -> bool:
        """True if there is something that has not been saved."""
        return self.recipe is not self._saved and self.recipe != self._saved

    def begin_with(self, recipe: Recipe) -> None:
        """Begin anew with another recipe, for which there is nothing to save or to undo."""
        self.history = History(recipe)
        self._saved = recipe

    def simulate_on(self, cells: int) -> None:
        """Let all states of the work be simulated on another grid: no edit, nothing to undo and nothing to save."""
        made: Made = {}
        self.history.replace_all(lambda recipe: on_grid(recipe, cells, made))
        self._saved = on_grid(self._saved, cells, made)

    @property
    def saved_recipe(self) -> Recipe:
        """The recipe as it was saved last, or opened."""
        return self._saved

    def restore(self, history: History, saved: Recipe) -> None:
        """Go on with all the edits of a session that has ended; `saved` is what had been saved of them."""
        self.history = history
        self._saved = saved

    def saved(self) -> None:
        """Take note that the work has been saved as it is now."""
        self._saved = self.recipe
