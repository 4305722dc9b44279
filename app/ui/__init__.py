"""The window: everything that knows imgui, and, in `window.py` alone, glfw."""
