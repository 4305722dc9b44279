"""Undo and redo: exact, shared, bounded."""

from __future__ import annotations

import random
from weakref import ref

import pytest

from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.model.undo import History


def stroke(seed: int, samples: int = 3) -> Stroke:
    return Stroke(tool="push", radius=0.1, samples=tuple((i, seed / 1000, i / samples, 1.0) for i in range(samples)))


def test_undo_and_redo_give_the_same_recipes():
    history = History(Recipe())
    states = [history.recipe]
    for seed in range(5):
        history.commit(f"Push {seed}", history.recipe.edited(stroke=(*history.recipe.stroke, stroke(seed))))
        states.append(history.recipe)
    assert (history.undo_name, history.redo_name) == ("Push 4", None)
    for state in states[-2::-1]:
        assert history.undo() is state
    assert not history.can_undo
    assert history.undo() is states[0]
    for state in states[1:]:
        assert history.redo() is state
    assert not history.can_redo


def test_an_edit_after_undo_ends_the_future():
    history = History(Recipe())
    history.commit("A", Recipe(name="a"))
    history.undo()
    history.commit("B", Recipe(name="b"))
    assert [entry.name for entry in history.entries] == ["Open", "B"]
    assert history.redo() is history.recipe


def test_an_edit_of_nothing_is_none():
    history = History(Recipe())
    history.commit("Nothing", Recipe())
    assert not history.can_undo


def test_all_states_replaced_are_no_edit():
    history = History(Recipe())
    for name in ("A", "B", "C"):
        history.commit(name, history.recipe.edited(name=name))
    history.undo()
    history.replace_all(lambda recipe: recipe.on_grid(64))
    assert [entry.name for entry in history.entries] == ["Open", "A", "B", "C"]
    assert (history.recipe.name, history.redo_name) == ("B", "C")
    assert {entry.recipe.fluid.grid for entry in history.entries} == {64}


def test_recipes_share_what_did_not_change():
    long = Recipe(stroke=tuple(stroke(seed, 1000) for seed in range(50)))
    history = History(long)
    before = history.nbytes
    for seed in range(100):
        history.commit("Push", history.recipe.edited(stroke=(*history.recipe.stroke, stroke(seed))))
    assert history.entries[-1].recipe.stroke[0] is long.stroke[0]
    assert history.nbytes - before < before / 10


def test_the_present_stays_though_it_is_beyond_the_budget():
    history = History(Recipe(), budget=1)
    for seed in range(2):
        history.commit("Push", Recipe(stroke=(stroke(seed),)))
        assert history.recipe.stroke == (stroke(seed),)
        assert not history.can_undo


def test_the_budget_drops_the_oldest():
    history = History(Recipe(), budget=200_000)
    for seed in range(100):
        history.commit(f"Push {seed}", Recipe(stroke=(stroke(seed, 100),)))
    assert history.nbytes <= 200_000
    assert history.entries[-1].name == "Push 99"
    assert 1 < len(history.entries) < 20


def test_random_actions_against_a_plain_list():
    for seed in range(20):
        rng = random.Random(seed)
        history = History(Recipe())
        model, present = [history.recipe], 0
        for step in range(200):
            action = rng.choice(["commit", "commit", "retract", "undo", "redo", "jump"])
            if action in ("commit", "retract"):
                recipe = Recipe(name=f"{seed} {step}")
                before = history.entries
                history.commit("Edit", recipe)
                if action == "retract":
                    assert history.retract() is model[present]
                    assert history.entries == before
                    continue
                del model[present + 1 :]
                model.append(recipe)
                present += 1
            elif action == "undo":
                history.undo()
                present = max(present - 1, 0)
            elif action == "redo":
                history.redo()
                present = min(present + 1, len(model) - 1)
            else:
                present = rng.randrange(len(model))
                history.go_to(present)
            assert history.recipe is model[present]
            assert (history.can_undo, history.can_redo) == (present > 0, present < len(model) - 1)


def test_what_is_retracted_has_never_been_and_so_has_ended_nothing():
    """Also on another grid by then; after anything else, nothing is taken back."""
    history = History(Recipe())
    for name in ("A", "B"):
        history.commit(name, Recipe(name=name))
    history.undo()
    before = history.entries
    history.commit("Long", Recipe(name="C", stroke=(stroke(1, 100),)))
    assert [entry.name for entry in history.entries] == ["Open", "A", "Long"]
    history.replace_all(lambda recipe: recipe.on_grid(64))
    assert history.retract().name == "A"
    assert [(entry.name, entry.number) for entry in history.entries] == [(one.name, one.number) for one in before]
    assert {entry.recipe.fluid.grid for entry in history.entries} == {64}
    assert (history.undo_name, history.redo_name) == ("A", "B")
    for does in (history.undo, history.redo, lambda: history.go_to(2), lambda: history.amend(Recipe(name="D"))):
        history.commit("C", Recipe(name="C"))
        does()
        entries, index = history.entries, history.index
        history.retract()
        assert (history.entries, history.index) == (entries, index)


def test_what_only_a_retraction_has_a_use_for_is_within_the_budget():
    """What an edit had pushed out was all held beside it until something else was done."""
    history = History(Recipe())
    for seed in range(8):
        history.commit(f"Push {seed}", Recipe(stroke=(stroke(seed, 100),)))
    history.budget = history.nbytes
    while history.can_undo:
        history.undo()
    held = [ref(entry.recipe) for entry in history.entries[1:]]
    history.commit("Long", Recipe(stroke=(stroke(9, 400),)))
    assert history.nbytes <= history.budget
    assert [one() is not None for one in held] == [True] * 4 + [False] * 4, "it takes the room of four"
    assert history.retract().stroke == ()
    assert [entry.name for entry in history.entries] == ["Open", *(f"Push {seed}" for seed in range(4))]
    history.go_to(4)
    history.commit("Longer", Recipe(stroke=(stroke(10, 1000),)))
    assert [entry.name for entry in history.entries] == ["Longer"]
    assert [one() is not None for one in held] == [False] * 3 + [True] + [False] * 4
    assert (history.retract().stroke, history.undo_name) == ((stroke(3, 100),), None)


def test_no_such_entry():
    with pytest.raises(IndexError, match="1 entries"):
        History(Recipe()).go_to(1)


def test_a_sample_takes_170_bytes_and_what_is_there_already_none():
    def grown(recipe: Recipe, more: Recipe) -> int:
        history = History(recipe)
        before = history.nbytes
        history.commit("More", more)
        return history.nbytes - before

    few, many = Recipe(stroke=(stroke(1, 10),)), Recipe(stroke=(stroke(1, 110),))
    assert grown(Recipe(), many) - grown(Recipe(), few) == 100 * 170
    assert grown(many, many.edited(stroke=(*many.stroke, stroke(2, 10)))) == grown(Recipe(), few) + 8
    assert grown(many, many.edited(name="other")) < 1100


def test_an_edit_that_is_joined_to_the_one_before_is_the_same_edit():
    history = History(Recipe())
    history.commit("Push", Recipe(name="a"))
    history.commit("Other", Recipe(name="b"))
    history.undo()
    history.amend(Recipe(name="a"))
    assert history.can_redo
    history.amend(Recipe(name="c"))
    assert [(entry.name, entry.recipe.name) for entry in history.entries] == [("Open", ""), ("Push", "c")]
    assert (history.undo_name, history.can_redo) == ("Push", False)


def test_a_recording_that_goes_on_is_the_same_edit_and_loses_nothing():
    history = History(Recipe())
    history.commit("Push", Recipe(name="a"))
    history.commit("Other", Recipe(name="b"))
    history.undo()
    history.go_on(Recipe(name="c"))
    assert [(entry.name, entry.recipe.name) for entry in history.entries] == [
        ("Open", ""),
        ("Push", "c"),
        ("Other", "b"),
    ]
    assert (history.undo_name, history.redo_name) == ("Push", "Other")
