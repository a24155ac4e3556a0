"""Pictures of every screen and dialog in every theme, landscape and portrait:  ``python -m tests.screenshots DIR``

A picture is a function that builds the content and returns the widget to check (the screen, or the dialog in front of
it):

    from tests.screenshots.registry import picture

    @picture("home")
    def home(studio):
        studio.show(HomeScreen(...))                 # in an empty window; or studio.window() for a whole app
        return studio.shown

    @picture("robot-sheet", sizes=(LANDSCAPE,))
    def robot_dialog(studio):
        studio.show(SettingsScreen(...))
        studio.sheets.show(RobotSheet(...))
        return studio.shown

Put such functions into a module of this package; all its modules are found. Files are called
``<name>-<size>-<theme>.png``. After each picture tests/ui/checks.py looks for what the eye might miss and prints it.
One process per window size, real GL without a display.
"""
