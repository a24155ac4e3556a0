"""The base of screens: results of other threads on the UI thread, view models that release what they hold, one screen at a time."""

from __future__ import annotations

import gc
import threading
import time
import weakref
from functools import partial
from itertools import pairwise
from types import SimpleNamespace

import pytest
from kivy.base import EventLoop
from kivy.core.window import Window
from kivy.properties import NumericProperty
from kivy.uix.label import Label

from app.i18n import translator
from app.screens.common import threads
from app.screens.common.threads import STAYING
from app.screens.common.view_model import Background, Navigator, Refresher, ScreenBase, UiBus, ViewModel
from app.widgets.buttons import CommandButton
from app.widgets.frame import Screens


class RobotRead:
    def __init__(self, robot: int, battery: int):
        self.robot, self.battery = robot, battery


class SlowRead(RobotRead):
    pass


@pytest.fixture
def bus(ui) -> UiBus:
    return UiBus(per_frame=50)


@pytest.fixture
def background(bus):
    background = Background(bus, workers=2)
    yield background
    background.close()


# ---------------------------------------------------------------------- bus
def test_events_of_many_threads_arrive_in_order_on_the_ui_thread(ui, bus):
    seen: dict[int, list[int]] = {n: [] for n in range(4)}
    threads: set[int] = set()

    def arrived(event):
        seen[event.robot].append(event.battery)
        threads.add(threading.get_ident())

    bus.subscribe(RobotRead, arrived)
    workers = [
        threading.Thread(target=lambda n=n: [bus.publish(RobotRead(n, i)) for i in range(500)]) for n in range(4)
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    ui.wait(lambda: sum(map(len, seen.values())) == 2000)
    assert all(values == list(range(500)) for values in seen.values())
    assert threads == {threading.get_ident()}


def test_a_frame_handles_only_so_many(ui, bus):
    seen: list[int] = []
    bus.subscribe(RobotRead, lambda event: seen.append(event.battery))
    for n in range(120):
        bus.publish(RobotRead(1, n))
    sizes = []
    for _n in range(4):
        EventLoop.idle()
        sizes.append(len(seen))
    assert sizes[0] <= 50
    assert all(later - earlier <= 50 for earlier, later in pairwise(sizes))
    ui.wait(lambda: len(seen) == 120)


def test_the_newest_event_of_a_key_is_kept(ui, bus):
    seen: list[tuple[int, int]] = []
    bus.subscribe(RobotRead, lambda event: seen.append((event.robot, event.battery)))
    for battery in range(100):
        for robot in (1, 2):
            bus.publish(RobotRead(robot, battery), key=robot)
    ui.advance()
    assert seen == [(1, 99), (2, 99)]
    bus.publish(RobotRead(1, 5), key=1)
    ui.advance()
    assert seen[2:] == [(1, 5)]


def test_a_subscriber_to_a_class_receives_its_subclasses(ui, bus):
    seen: list[str] = []
    bus.subscribe(RobotRead, lambda event: seen.append(type(event).__name__))
    stop = bus.subscribe(SlowRead, lambda event: seen.append("slow"))
    bus.publish(SlowRead(1, 1))
    ui.advance()
    stop()
    bus.publish(SlowRead(1, 1))
    ui.advance()
    assert seen == ["slow", "SlowRead", "SlowRead"]


def test_a_broken_handler_does_not_stop_the_others(ui, bus, caplog):
    seen: list[int] = []
    bus.subscribe(RobotRead, lambda event: 1 / 0)
    bus.subscribe(RobotRead, lambda event: seen.append(event.battery))
    bus.publish(RobotRead(1, 7))
    ui.advance()
    assert seen == [7]
    assert "ZeroDivisionError" in caplog.text


# ---------------------------------------------------------------------- background
def test_work_runs_elsewhere_and_its_result_comes_home(ui, background):
    worked: list[int] = []
    done: list[tuple[int, int]] = []

    def work():
        worked.append(threading.get_ident())
        return 42

    background.run(work, lambda result: done.append((result, threading.get_ident())))
    ui.wait(lambda: background.idle)
    assert done == [(42, threading.get_ident())]
    assert worked[0] != threading.get_ident()


def test_a_failure_is_delivered_too(ui, background):
    failures: list[BaseException] = []
    background.run(lambda: 1 / 0, failed=failures.append)
    ui.wait(lambda: background.idle)
    assert isinstance(failures[0], ZeroDivisionError)


def test_a_failure_without_a_handler_is_reported_and_logged(ui, bus, caplog):
    reported: list[BaseException] = []
    background = Background(bus, unexpected=reported.append)
    background.run(lambda: {}["missing"])
    ui.wait(lambda: background.idle)
    background.close()
    assert isinstance(reported[0], KeyError)
    assert "work in the background failed" in caplog.text


def test_newer_work_with_the_same_key_supersedes_older(ui, background):
    gate = threading.Event()
    done: list[str] = []

    def slow():
        gate.wait(30)
        return "old"

    background.run(slow, done.append, key="search")
    background.run(lambda: "new", done.append, key="search")
    ui.wait(lambda: done == ["new"])
    gate.set()
    ui.wait(lambda: background.idle)
    assert done == ["new"]


def test_threads_of_work_apart_end_with_it(ui, background):
    """There is a name for each robot that was ever looked into."""

    def threads() -> list[str]:
        return [thread.name for thread in threading.enumerate() if thread.name.startswith("ui-check-up")]

    done, go = [], threading.Event()
    for n in range(6):
        background.run(lambda n=n: go.wait(30) and n, done.append, apart=f"check-up {n // 2}")
    assert len(threads()) == 6
    go.set()
    ui.wait(lambda: len(done) == 6 and not threads())
    background.run(lambda: "again", done.append, apart="check-up 0")
    ui.wait(lambda: done[-1] == "again" and not threads())


@pytest.mark.parametrize(("count", "stay"), [(STAYING, STAYING), (STAYING + 4, 0)])
def test_threads_that_a_crowd_needed_end_with_it(ui, bus, count, stay):
    """Each keeps a reader of the database."""

    def threads() -> set[threading.Thread]:
        return set(threading.enumerate()) - others

    others = set(threading.enumerate())
    background, done, go = Background(bus), [], threading.Event()
    for n in range(count):
        background.run(lambda n=n: go.wait(30) and n, done.append)
    assert len(threads()) == count
    go.set()
    ui.wait(lambda: len(done) == count and len(threads()) == stay)
    background.run(lambda: "again", done.append)
    ui.wait(lambda: done[-1] == "again")
    background.close()
    with pytest.raises(RuntimeError):
        background.run(lambda: "late")


def test_work_queued_before_the_end_is_done_and_separate_work_is_not_awaited(ui, bus, monkeypatch):
    """The services close after the window: a number that was stepped a moment before has to be saved by then."""
    monkeypatch.setattr(threads, "LAST_WORDS", 30)
    background, done, go = Background(bus, workers=1), [], threading.Event()
    for _n in range(3):
        background.run(lambda: done.append(go.wait(30)), apart="check-up")
    background.run(lambda: time.sleep(0.05))  # s
    background.run(lambda: done.append("saved"))
    background.close()
    assert done == ["saved"]
    go.set()


@pytest.mark.parametrize(("apart", "logged"), [("", True), ("check-up", False)])
def test_what_fails_after_the_end_is_logged_if_it_was_pressed(ui, bus, caplog, apart, logged):
    """A robot that refuses while the window closes fails no press, and its traceback would keep the screen."""
    background, began, go = Background(bus), threading.Event(), threading.Event()

    def refused():
        began.set()
        go.wait(30)
        raise ConnectionError

    background.run(refused, apart=apart)
    work = [thread for thread in threading.enumerate() if thread.name.startswith("ui-")]
    assert began.wait(30)
    background.close()
    go.set()
    for thread in work:
        thread.join(30)
    assert ("work in the background failed" in caplog.text) is logged


def test_cancelled_work_delivers_nothing(ui, background):
    gate = threading.Event()
    done: list[object] = []
    job = background.run(lambda: gate.wait(30), done.append)
    job.cancel()
    gate.set()
    ui.wait(lambda: background.idle)
    assert done == []
    assert job.finished


# ---------------------------------------------------------------------- view models and screens
class Model(ViewModel):
    ticks = NumericProperty(0)

    def __init__(self, bus: UiBus):
        super().__init__()
        self._bus = bus
        self.heard: list[int] = []
        self.calls: list[object] = []

    def opened(self, **intent):
        self.calls.append(("opened", intent))
        self.keep(self._bus.subscribe(RobotRead, lambda event: self.heard.append(event.battery)))
        self.every(1, self._tick)

    def closed(self):
        self.calls.append("closed")

    def retranslated(self):
        self.calls.append("retranslated")

    def _tick(self):
        self.ticks += 1


def test_a_view_model_listens_and_ticks_only_while_shown(ui, bus):
    model = Model(bus)
    bus.publish(RobotRead(1, 1))
    ui.advance()
    model.open(section="robots")
    bus.publish(RobotRead(1, 2))
    ui.advance(3.1)
    model.close()
    bus.publish(RobotRead(1, 3))
    ui.advance(3)
    assert model.heard == [2]
    assert model.ticks == 3
    assert model.calls == [("opened", {"section": "robots"}), "closed"]


def test_a_screen_that_is_not_shown_reads_nothing(ui, background):
    """A finger may be lifted after its screen was closed and after the last work was taken."""
    read: list[int] = []
    shell = SimpleNamespace(background=background, say_problem=pytest.fail)
    reader = Refresher(shell, lambda: lambda: len(read), read.append)
    reader.read()
    stop = reader.start()
    reader.read()
    ui.wait(lambda: read == [0])
    stop()
    background.close()
    reader.read()
    reader.request()
    ui.advance()
    assert read == [0]


def test_a_view_model_hears_of_the_language_while_shown_or_before_it_is_shown_again(ui, bus):
    model = Model(bus)
    translator.use("en")
    model.open()
    translator.use("en")
    model.close()
    translator.use("fi")
    assert model.calls == [("opened", {}), "retranslated", "closed"]
    model.open()
    translator.use("en")
    model.close()
    model.open()
    assert model.calls[3:] == ["retranslated", ("opened", {}), "retranslated", "closed", ("opened", {})]


def test_opening_twice_subscribes_once(ui, bus):
    model = Model(bus)
    model.open()
    model.open(section="data")
    bus.publish(RobotRead(1, 9))
    ui.advance()
    assert model.heard == [9]


def test_a_screen_knows_how_the_window_is_held_whatever_an_alarm_leaves_of_it(ui):
    before = Window.size
    screen = ui.show(ScreenBase(), (1280, 600))
    assert not screen.tall
    Window.size = 600, 800
    screen.size = 552, 520
    assert screen.tall
    Window.size = before


class Page(ScreenBase):
    def __init__(self, name: str, log: list):
        super().__init__()
        self.add_widget(Label(text=name))
        self._log = log

    def shown(self, **intent):
        self._log.append(("shown", self.name, intent))

    def hidden(self):
        self._log.append(("hidden", self.name))


@pytest.fixture
def log() -> list:
    return []


@pytest.fixture
def navigator(ui, log) -> Navigator:
    return Navigator(ui.show(Screens()), {name: partial(Page, name, log) for name in ("home", "logs", "settings")})


def test_screens_are_built_on_their_first_visit_and_kept(ui, navigator, log):
    navigator.go("home")
    assert navigator.built == ["home"]
    home = navigator.screen("home")
    navigator.go("logs", execution_id=7)
    navigator.go("home")
    assert navigator.screen("home") is home
    assert log == [
        ("shown", "home", {}),
        ("hidden", "home"),
        ("shown", "logs", {"execution_id": 7}),
        ("hidden", "logs"),
        ("shown", "home", {}),
    ]
    ui.advance()
    assert ui.texts() == ["home"]


def test_going_where_one_is_brings_the_new_wish(navigator, log):
    navigator.go("logs")
    navigator.go("logs", execution_id=9)
    assert log[-2:] == [("hidden", "logs"), ("shown", "logs", {"execution_id": 9})]


def test_the_next_screen_is_there_at_once(ui, navigator):
    """KivyMD's manager takes a transition of its own for 0.4 s, in which both are drawn, and so does kivy's "no transition" for a frame."""
    for name in ("home", "logs", "home"):
        navigator.go(name)
        assert ui.texts() == [name]
        ui.advance(0.2)
        assert ui.texts() == [name]


def test_an_unknown_screen_leaves_the_present_one(navigator, log):
    navigator.go("home")
    with pytest.raises(KeyError):
        navigator.go("nowhere")
    assert navigator.current == "home"
    assert log == [("shown", "home", {})]


def test_rebuilding_makes_new_screens(navigator, log):
    navigator.go("home")
    home = navigator.screen("home")
    navigator.rebuild()
    assert navigator.screen("home") is not home
    assert log == [("shown", "home", {}), ("hidden", "home"), ("shown", "home", {})]


def test_discarded_screens_are_freed_and_not_shown_again(ui, navigator, log):
    """The next ones take their memory: Home alone is 27 MB."""
    for name in ("home", "logs", "settings"):
        navigator.go(name)
        ui.advance()
    old, entered = [weakref.ref(navigator.screen(name)) for name in navigator.built], []
    for screen in old:
        screen().bind(on_pre_enter=lambda screen: entered.append(screen.name))
    navigator.rebuild()
    ui.advance(0.1)
    gc.collect()
    assert entered == []
    assert [screen() for screen in old] == [None] * 3


def test_closing_hides_the_present_screen(navigator, log):
    navigator.go("home")
    navigator.close()
    assert log[-1] == ("hidden", "home")


@pytest.mark.parametrize("change", ["rebuild", "close"])
def test_a_finger_on_a_screen_that_goes_presses_nothing(ui, navigator, change):
    navigator.go("home")
    home, pressed = navigator.screen("home"), []
    button = CommandButton(text="Start", on_release=pressed.append)
    home.add_widget(button)
    ui.advance()
    lift = ui.press(button)
    getattr(navigator, change)()
    lift()
    assert pressed == []
