"""A program that lets files fall on a window, as a file manager does: the source's side of XDND, version 5.

`python tests/support/dropping.py WINDOW FILE...` under the display in DISPLAY; its status is 0 once they were taken.
https://www.freedesktop.org/wiki/Specifications/XDND/
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from Xlib import X, display
from Xlib.protocol import event

PATIENCE = 20.0


def drop(window: int, files: list[Path]) -> bool:
    """Drag the files to the middle of the window and let them go; True once it says that it has taken them."""
    screen = display.Display()
    atom = screen.intern_atom
    uris, selection = atom("text/uri-list"), atom("XdndSelection")
    target = screen.create_resource_object("window", window)
    aware: Any = target.get_full_property(atom("XdndAware"), X.AnyPropertyType)
    assert aware is not None, "the window takes no drops"
    source = screen.screen().root.create_window(0, 0, 1, 1, 0, X.CopyFromParent)
    source.set_selection_owner(selection, X.CurrentTime)
    corner = target.translate_coords(screen.screen().root, 0, 0)
    size = target.get_geometry()
    place = (-corner.x + size.width // 2) << 16 | (-corner.y + size.height // 2)
    text = "".join(f"{file.resolve().as_uri()}\r\n" for file in files).encode()

    def tell(name: str, *words: int) -> None:
        data = (32, [source.id, *words, *[0] * (4 - len(words))])
        target.send_event(event.ClientMessage(window=target, client_type=atom(name), data=data))
        screen.flush()

    tell("XdndEnter", min(5, aware.value[0]) << 24, uris)
    tell("XdndPosition", 0, place, X.CurrentTime, atom("XdndActionCopy"))
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if not screen.pending_events():
            time.sleep(0.01)
            continue
        heard: Any = screen.next_event()
        if heard.type == X.SelectionRequest:
            heard.requestor.change_property(heard.property, heard.target, 8, text)
            done = event.SelectionNotify(
                time=heard.time,
                requestor=heard.requestor,
                selection=heard.selection,
                target=heard.target,
                property=heard.property,
            )
            heard.requestor.send_event(done)
            screen.flush()
        elif heard.type == X.ClientMessage and heard.client_type == atom("XdndStatus"):
            assert heard.data[1][1] & 1, "the window refuses the files"
            tell("XdndDrop", 0, X.CurrentTime)
        elif heard.type == X.ClientMessage and heard.client_type == atom("XdndFinished"):
            # Bit 0 by the letter; GLFW puts the number of bytes there that it has taken.
            return heard.data[1][1] != 0
    return False


if __name__ == "__main__":
    sys.exit(0 if drop(int(sys.argv[1]), [Path(name) for name in sys.argv[2:]]) else 1)
