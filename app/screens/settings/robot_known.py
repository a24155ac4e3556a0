"""The sheet of a robot, the part that is saved at once: its name, use, groups and hand-over; and its menu."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

from kivy.properties import AliasProperty, BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain.models import HandOver, Robot
from app.i18n import _
from app.screens.common import formats
from app.screens.common.options import MenuItem, Option
from app.screens.settings import removals
from app.screens.settings.edit_sheet import EditForm, EditSheet, ask_and_delete
from app.screens.settings.view import NoticeView, advanced_item, idle_phrase, robot_note
from app.services.catalogue import group_edit
from app.services.catalogue.edit import Edit

AT_ONCE = ("name", "enabled", "hand_over")
ENDPOINT = ("address", "username", "fingerprint")


def endpoint_of(robot: Robot) -> tuple[str, str, str]:
    """What a stored password belongs to, as the sheet shows it."""
    return formats.address(robot.address), robot.username, robot.certificate_sha256 or ""


class RobotForm(EditForm):
    """What is entered, one problem per field, and the result of the test."""

    name = StringProperty()
    address = StringProperty()
    username = StringProperty()
    password = StringProperty()
    fingerprint = StringProperty()
    enabled = BooleanProperty(True)
    hand_over = StringProperty(HandOver.AT_ONCE)
    hand_overs = ListProperty()
    name_problem = StringProperty()
    address_problem = StringProperty()
    username_problem = StringProperty()
    password_problem = StringProperty()
    fingerprint_problem = StringProperty()
    password_hint = StringProperty()
    testing = BooleanProperty(False)
    about = ObjectProperty(NoticeView())  # what answers
    groups = StringProperty()
    has_groups = BooleanProperty(False)  # there are some
    idle = StringProperty()
    advanced = BooleanProperty(False)  # is unfolded
    advanced_row = ListProperty()

    def _is_https(self) -> bool:
        return self.address.strip().lower().startswith("https:") or bool(self.fingerprint_problem)

    is_https = AliasProperty(_is_https, None, bind=("address", "fingerprint_problem"))

    @property
    def endpoint(self) -> tuple[str, str, str]:
        """What is entered of ``endpoint_of``."""
        return self.address.strip(), self.username.strip(), self.fingerprint.strip()

    @property
    def connection(self) -> tuple[str, ...]:
        """Everything that a test depends on."""
        return self.address, self.username, self.password, self.fingerprint


class KnownRobotSheet(EditSheet):
    """Also adds a robot, which has none of this yet."""

    kind = "robots"

    open_check_up: Callable[[Robot], object]

    def show_facts(self) -> None:
        """What is known of the robot now."""
        facts, form = self.context.facts, self.vm
        robot = facts.robot(self.stored_id)
        if robot is not None and not form.saving:
            for name in AT_ONCE:
                if getattr(robot, name) != getattr(self.stored, name):
                    setattr(form, name, getattr(robot, name))
            before, self.stored = endpoint_of(self.stored), robot
            for name, was, now in zip(ENDPOINT, before, endpoint_of(robot), strict=True):
                if was != now and getattr(form, name).strip() == was:  # nothing else was entered
                    setattr(form, name, now)
            form.about = robot_note(facts, robot, self.context.now())
            form.groups = ", ".join(group.name for group in facts.groups if robot.id in group.members)
            form.has_groups = bool(facts.groups)
            form.idle = idle_phrase(facts, robot)
        form.title = self.stored.name if self.stored is not None else _("Add robot")
        form.advanced_row = [advanced_item(HandOver(form.hand_over), is_open=form.advanced)]

    def turn_advanced(self) -> None:
        self.vm.advanced = not self.vm.advanced
        self.show_facts()

    def on_dots(self, button: Widget) -> None:
        robot, go = self.stored, self.context.shell.go
        items = [
            MenuItem("check up", _("Check up"), "clipboard-check-outline"),
            MenuItem("fetch", _("Fetch missions"), "download-outline", disabled=not robot.enabled),
            MenuItem("delete", _("Delete"), "delete-outline", tone="fault"),
        ]
        acts: dict[str, Callable[[], object]] = {
            "check up": lambda: self.open_check_up(robot),
            "fetch": lambda: go("settings", section="missions", fetch_from=robot.id),
            "delete": self.remove,
        }
        self.context.shell.dialogs.menu(button, "", items, lambda key: acts[key]())

    def remove(self) -> None:
        context, robot = self.context, self.stored
        ask_and_delete(
            context,
            robot,
            lambda: context.services.catalogue.remove_robot(robot.id),
            removals.robot_question(context.facts, robot),
        )

    def refuse(self, problem: BaseException) -> None:
        """Show as it is what was not saved; a refused name stays, to be corrected."""
        super().refuse(problem)
        if self.stored is not None:
            self.vm.enabled = self.stored.enabled or self.stored.needs_password
            self.vm.hand_over = self.stored.hand_over

    def settled(self) -> Robot:
        form = self.vm
        enabled = form.enabled if not self.stored.needs_password else self.stored.enabled
        robot: Robot = self.stored
        return replace(robot, name=form.name.strip(), enabled=enabled, hand_over=HandOver(form.hand_over))

    def pick_groups(self) -> None:
        groups, robot_id = self.context.facts.groups, self.stored.id
        self.context.shell.dialogs.choose_many(
            _("Groups"),
            [Option(group.id, group.name, "account-group-outline") for group in groups],
            _("Set"),
            self._join,
            selected=[group.id for group in groups if robot_id in group.members],
        )

    def _join(self, chosen: Collection[int]) -> None:
        """Be a member of these groups only."""
        context, robot = self.context, self.stored
        before = {group.id for group in context.facts.groups if robot.id in group.members}
        turned = before ^ set(chosen)

        def save(joined: Collection[int]) -> None:
            def work(edit: Edit) -> None:
                for group_id in turned:
                    group = edit.the_group(group_id)
                    members = {*group.members, robot.id} if group_id in joined else {*group.members} - {robot.id}
                    group_edit.save(edit, replace(group, members=tuple(members)))

            context.services.catalogue.edit(work)

        def saved(_none: object) -> None:
            context.refresh()
            text = _("{name} saved").format(name=robot.name)
            context.shell.offer_undo(text, lambda: save(before), context.refresh, behind="settings", about=self)

        if turned:
            context.run(lambda: save(chosen), saved)

    def go_idle(self) -> None:
        self.context.shell.go("settings", section="idle", robot_id=self.stored.id)
