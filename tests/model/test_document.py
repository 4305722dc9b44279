"""The work that is open: what of it is not saved yet, and how much of it undo may hold."""

from __future__ import annotations

from app.model.document import Document
from app.model.recipe import Recipe
from app.model.undo import DEFAULT_BUDGET, History


def document() -> Document:
    return Document(Recipe())


def test_what_is_edited_is_to_be_saved_until_it_is_or_is_undone() -> None:
    work = document()
    assert not work.is_dirty
    work.history.commit("Amount", Recipe(amount=0.5))
    assert (work.is_dirty, work.recipe.amount, work.saved_recipe.amount) == (True, 0.5, 1.0)
    work.history.undo()
    assert not work.is_dirty
    work.history.redo()
    work.saved()
    assert not work.is_dirty
    work.history.undo()
    assert work.is_dirty


def test_another_grid_is_nothing_to_save_and_nothing_to_undo() -> None:
    work = document()
    work.history.commit("Amount", Recipe(amount=0.5))
    for is_dirty in (True, False):
        if not is_dirty:
            work.history.undo()
        work.simulate_on(64)
        assert (work.is_dirty, work.saved_recipe.fluid.grid, work.recipe.fluid.grid) == (is_dirty, 64, 64)
    assert [entry.name for entry in work.history.entries] == ["Open", "Amount"]


def test_to_begin_with_another_recipe_forgets_what_was() -> None:
    work = document()
    work.history.commit("Amount", Recipe(amount=0.5))
    work.begin_with(Recipe(name="b"))
    assert (work.recipe.name, work.is_dirty, work.history.can_undo) == ("b", False, False)


def test_a_session_that_is_restored_has_its_edits_and_what_was_saved_of_them() -> None:
    history, work = History(Recipe(name="a")), document()
    history.commit("Name", Recipe(name="b"))
    work.restore(history, Recipe(name="a"))
    assert (work.recipe.name, work.saved_recipe.name, work.is_dirty) == ("b", "a", True)


def test_undo_holds_a_quarter_of_a_gibibyte() -> None:
    assert document().history.budget == DEFAULT_BUDGET == 2**28
