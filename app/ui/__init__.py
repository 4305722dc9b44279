"""The window: everything that knows imgui, and, in `window.py` and `callbacks.py` alone, glfw."""
