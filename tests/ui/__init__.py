"""Tests of the window without a display: kivy's layout, properties, clock, touches and text metrics are real, only the drawing is not.

Pixels are the business of ``python -m tests.screenshots``. ``UI_LANE=offscreen pytest tests/ui`` runs the same tests on real GL.
"""
