"""Whether a window can be opened, told as JSON on standard output; run as a program of its own by `app.doctor`.

A window's GL and a headless one must not meet in one process: where both come from X, that kills it.
"""

from __future__ import annotations

import json
import sys


def probe() -> dict[str, str]:
    """Open a hidden window as the editor would; tells its platform and GL, or the error."""
    import glfw

    problems: list[str] = []
    glfw.ERROR_REPORTING = False
    glfw.set_error_callback(lambda code, words: problems.append(_text(words)))
    if not glfw.init():
        return {"error": "; ".join(problems) or "GLFW does not start"}
    try:
        glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
        glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
        glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
        glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
        window = glfw.create_window(64, 64, "fluidwarp", None, None)
        if not window:
            return {"error": "; ".join(problems) or "no window"}
        platforms = {glfw.PLATFORM_WAYLAND: "Wayland", glfw.PLATFORM_X11: "X11"}
        return {"platform": platforms.get(glfw.get_platform(), "other"), "opengl": _version(glfw, window)}
    finally:
        glfw.terminate()


def _text(words: str | bytes) -> str:
    return words if isinstance(words, str) else words.decode("utf-8", "replace")


def _version(glfw: object, window: object) -> str:
    import moderngl

    glfw.make_context_current(window)  # pyright: ignore[reportAttributeAccessIssue]
    info = moderngl.create_context(require=330).info
    return f"{info['GL_VERSION']}, {info['GL_RENDERER']}"


if __name__ == "__main__":
    json.dump(probe(), sys.stdout)
