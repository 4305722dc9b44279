"""The choice between the feels of the fluid, as it stands in the bar and in the inspector."""

from __future__ import annotations

from app.model.presets import FEELS, Feel
from app.ui.editor_state import EditorState
from app.ui.widgets import Ui
from app.work.session import Session


def choose(ui: Ui, name: str, session: Session, state: EditorState, width: float = 0.0) -> Feel | None:
    """Let the fluid feel so from where work goes on, and pushes be as local as is best for it; the feel until now."""
    fluid = session.recipe.fluid_at(session.next_tick)
    now = next((number for number, feel in enumerate(FEELS) if feel.fits(fluid)), -1)
    chosen = ui.segmented(name, [feel.name for feel in FEELS], now, width)
    if chosen != now:
        feel = FEELS[chosen]
        session.change(feel.name, viscosity=feel.viscosity, drag=feel.drag)
        state.make_local(feel.local)
    return FEELS[now] if now >= 0 else None
