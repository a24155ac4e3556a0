"""The sheets of the window: one at a time, beside the page."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Any

from app.i18n import _

if TYPE_CHECKING:
    from app.screens.common.view_model import Navigator, Snackbars
    from app.widgets.choices import Picker
    from app.widgets.sheet import Sheet


class Sheets:
    """Shows sheets in ``frame_place``, a SheetPlace of the frame, or over the window where there is no frame. The sheet closes when another
    screen is shown. A ``draft`` that was closed with X, Esc or by leaving the screen can be had back with Undo.

    Who opened a sheet closes that one alone, wherever it lies: what the user has opened since stays."""

    def __init__(
        self, place: Any = None, snackbars: Snackbars | None = None, navigator: Navigator | None = None
    ) -> None:
        self.frame_place = place
        self._snackbars, self._navigator = snackbars, navigator
        self.spared: Callable[[], Any] = lambda: None  # what of the page is never covered
        self._stack: list[Sheet] = []  # the last one is shown; the arrow leads back to the one before
        if navigator is not None:
            navigator.bind(on_hide=lambda *_args: self.give_up())

    @property
    def _place(self) -> Any:
        if self.frame_place is not None:
            return self.frame_place
        from kivy.core.window import Window  # not before the window is configured

        return Window

    @property
    def top(self) -> Sheet | None:
        """The one that is shown, or that a picker asks for."""
        return next((sheet for sheet in reversed(self._stack) if not sheet.is_picker), None)

    @property
    def picker(self) -> Sheet | None:
        """What asks for a value now."""
        return self._stack[-1] if self._stack and self._stack[-1].is_picker else None

    def has(self, sheet: Sheet) -> bool:
        """It is shown, or below the one that is."""
        return sheet in self._stack

    def show(self, sheet: Sheet) -> Sheet:
        """Show it, in the place of what was shown before. If it lies below another one, it stays there."""
        if not self.has(sheet):
            self.give_up()
            self._put(sheet)
        return sheet

    def over(self, sheet: Sheet) -> Sheet:
        """Show it in the place of the present one, to which its arrow and its X lead back. A question takes the place of another one, as
        after a double tap."""
        if self._stack and self._stack[-1].is_question and sheet.is_question:
            self.close(self._stack[-1])
        if sheet.is_question:
            self._give_keys(sheet)
        if self._stack:
            below = self._stack[-1]
            below.leave(foot=not sheet.is_picker)
            sheet.can_go_back = True
            if sheet.is_picker:
                sheet.lie_as(below)
        self._put(sheet)
        return sheet

    def pick(self, picker: Picker, done: Callable[[Any], object]) -> Picker:
        """Ask for a value; ``done(value)``."""

        def picked(_picker: Picker, value: Any) -> None:
            self.close(picker)
            done(value)

        picker.bind(on_pick=picked)
        self.over(picker)
        return picker

    def ask(self, title: str, text: str, action: str, done: Callable[[], object], keep: str = "") -> Sheet:
        """Ask before what can't be undone: ``action`` is the word that does it. ``keep`` the safe answer, if it is a risk."""
        from app.widgets.sheet import AskSheet

        sheet = AskSheet(title=title, text=text, foot=keep or action, second=action if keep else "", closable=not keep)

        def agreed(*_args: object) -> None:
            self.close(sheet)
            done()

        sheet.bind(on_done=(lambda *_args: self.close(sheet)) if keep else agreed, on_other=agreed)
        self.over(sheet)
        return sheet

    def close(self, sheet: Sheet | None) -> None:
        """What was entered there is done with, also if it was given up since, and so is a picker that asks for it. The one below it is
        shown again."""
        if sheet is not None and self._snackbars is not None:
            self._snackbars.end(_draft_of(sheet))
        if sheet is None or not self.has(sheet):
            return
        if self.picker is not None and self.top == sheet:
            self.close(self.picker)
        was_shown = sheet == self._stack[-1]  # kv calls with a proxy of it
        self._stack.remove(sheet)
        if was_shown:
            sheet.leave()
            below = self._stack[-1] if self._stack else None
            if below is not None:
                self._place.add_widget(below)
            self._give_keys(below)

    def _give_keys(self, sheet: Sheet | None) -> None:
        """Alone to one that asks."""
        from app.widgets.dock import dock

        dock.question = sheet if sheet is not None and sheet.is_question else None

    def dismiss(self, sheet: Sheet) -> None:
        """Its X, or Esc."""
        if len(self._stack) > 1:
            self.close(sheet)
        elif self.has(sheet):
            self.give_up()

    def give_up(self) -> None:
        """Close all, and offer to bring a draft back."""
        stack, self._stack = self._stack, []
        if stack:
            stack[-1].leave()
        self._give_keys(None)
        navigator, snackbars = self._navigator, self._snackbars
        if navigator is None or snackbars is None or not any(sheet.draft for sheet in stack):
            return
        left = next(sheet for sheet in stack if sheet.draft)
        screen, about, said = navigator.current, _draft_of(left), left.lost or _("Not saved")

        def bring_back() -> None:
            if navigator.current != screen:
                navigator.show(screen)
            self.give_up()
            self._stack = stack
            self._place.add_widget(stack[-1])
            self._give_keys(stack[-1])

        offer_undo(navigator, snackbars, said, bring_back, behind=screen, about=about)

    def _put(self, sheet: Sheet) -> None:
        sheet.stack = self
        self._stack.append(sheet)
        self._place.add_widget(sheet)


def offer_undo(
    navigator: Navigator, snackbars: Snackbars, text: str, undo: Callable[[], object], *, behind: str, about: Hashable
) -> None:
    """Show ``text`` with Undo, instead of messages ``about`` the same, until the guard of the screen ``behind`` lets the user pass."""

    def offer() -> None:
        snackbars.end(about)
        snackbars.undo(text, _("Undo"), pressed, about=about)

    def pressed() -> None:
        offer()
        navigator.past_guard(behind, passed)

    def passed() -> None:
        snackbars.end(about)
        undo()

    offer()


def _draft_of(sheet: Sheet) -> Hashable:
    """The subject of messages about what was entered there."""
    return "draft", sheet.uid  # kv calls with a proxy, which has no hash
