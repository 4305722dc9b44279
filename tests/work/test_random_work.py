"""The properties of `session.py` and `work.py` with few and always the same examples; `nightly.py` tries new ones."""

from __future__ import annotations

from properties import session, work
from solver.gl.device import Device


def test_every_act_of_a_session_can_be_undone_saved_and_recovered(device: Device) -> None:
    session.walk(device)


def test_random_work_is_undone_saved_and_opened_again_as_it_was(device: Device) -> None:
    session.check_session(device, 3, examples=2, acts=12)


def test_a_recipe_of_any_numbers_is_refused_or_played(device: Device) -> None:
    # Hypothesis also draws numbers that it finds in the modules that are loaded, so how many are played varies.
    assert work.check_recipes(device, 0, examples=60)["played"] > 8
