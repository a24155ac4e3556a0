"""The app's own widgets, and how to use them. They know no service, hold no sample data, and get every text from their user.

Call ``load()`` once before the first widget; then all classes and the constants below are known to kv. A screen's kv starts with

    #:kivy 2.3.1
    #:import tk app.widgets.tokens.tk
    #:import tr app.widgets.tr.tr

and is loaded by its screen's module: ``load_kv("home/screen")`` for kv/home/screen.kv, once per process whoever asks.

Colours and sizes
    ``tk.<colour>``        tokens.py has them all: bg surface surface2 line outline, ink ink2 ink3 (text, ever quieter), accent…,
                           per tone (fault attention action done neutral offline accent)
                           ``<tone>``, ``<tone>_bg``, ``<tone>_on``, ``<tone>_solid``
    ``tk.h_touch h_field h_action``   least side of targets 48/64 dp, fields 56/64, the operator's buttons 64/120 (gloves)
    MARGIN GAP PAD S4 S8 S12 S16 S24 R_CARD R_CTRL R_PILL CLEAR     constants of tokens.kv
    Switch live: ``apply_theme(theme_cls, "light" | "dark" | "contrast", gloves=False)``. Colour is for what is abnormal; a state is always
    icon + word + colour. Only one ``style: "filled"`` button per screen.

Text (each a label as high as its lines; it wraps, it is never cut)
    Body BodyStrong (16) · Note NoteStrong (14) · Title Value (20) · BigValue ScreenTitle (24) · StateWord (28) · Kpi (36)
    ``fit: True`` as wide as its text (``max_width`` wraps it then) · ``Ico: icon: "wifi"`` ·
    ``Lines:`` texts under each other, centred in a row

Cards and facts (display.py)
    SectionCard · CardHead(title, note) · Tile · Hair · StatusBadge(tone, icon, text, loud) · Disc · ValueTile(icon, label, value, note,
    note_icon, level, mark, stale, tone) · Fact(label, value, icon, tone) · Notice(tone, icon, text, note) ·
    KpiCard(label, value, note, history) with
    ``with_unit("98.1", "%")`` · EmptyState(icon, title, text, action, action_icon; on_release) · LegendItem(kind, text)

Buttons (buttons.py; ``on_release`` unless said)
    CommandButton(style filled|tonal|outlined|plain|danger|onsolid, icon, text, stacked, large, busy, natural_width) · IconButton(icon) ·
    ChoiceChip(text, icon, trailing, selected) · Segments(options [(key, word)], selected; on_choose(key)) · Segment ·
    Toggle(active, controlled; on_switch(wanted))

Fields (fields.py; ``label`` above, ``help`` below, ``problem`` = one sentence that turns it red)
    FormField(text, hint, kind text|int|decimal|url, password, max_length; on_commit(text), on_enter; show(text)) ·
    StepField(value, minimum, maximum, step, unit, optional; on_commit(value)) · PickField(label, value, icon, problem; on_release) ·
    SearchField(text, hint)

Lists (lists.py, long_list.py; rows are dicts of the row class's properties with a ``key``;
``on_action(key, action, *values)`` comes from the rows)
    Rows          all rows, in a box of your making
    ScrollRows    some dozens; scrolls, rests on whole rows; ``empty_text``; ``direction: "x"`` for a strip
    LongList      thousands; row classes mix in ``RecycledRow``; ``on_end`` asks for the next page
    ScrollPage    a page or card that scrolls; give it children
    Rows there are (rows.py): RobotChip QueueRow PlanRow DoneRow NextStart ScheduleRow StoryStep LogRow SectionRow OptionRow
    A new one: ``class AlarmRow(Row, Toned, BoxLayout)`` with properties, a kv rule whose height follows its texts, ``self.act("name")``.

Drawings (chart.py, charts.py, timeline.py, robot_map.py)
    Meter Sparkline StackedBars RobotBars Timeline(on_bar(key), on_window(first, hours)) RobotMap Swatch AmrGlyph WorkingRing; a new one:
    subclass ``Chart``

Dialogs (dialogs.py, pickers.py; screens open them through ``app.screens.common.overlays.Dialogs``)
    FormDialog ConfirmDialog ChoiceDialog Menu TimeDialog DateDialog; your own: see dialogs.py. ``Snackbars`` (snackbar.py): show, undo.

The frame (frame.py): ``Frame`` holds top bar, banner, body and navigation; built once by the window.

Traps
    - Never name a property ``x`` and an event ``on_x``: kivy takes the event for the property's handler.
    - A kv binding of a base rule lives on beside the one that overrides it; override sizes of the same inputs, or use another property.
    - Class names must not exist in kivy's Factory (``Screen``, ``ActionButton``, ``Spinner`` …): the first one registered wins silently.
    - Widgets made by kv get their rule after ``__init__``; reach for ``self.ids`` in ``on_kv_post``.
    - Rounded shapes through ``Surface`` or ``rounded()``; what has a ``fill`` property cannot have a method of that name.
    - Heights in dp clip at font scale 1.3: use ``minimum_height`` or ``max(dp(48), lines.height + S8)``.
"""
from pathlib import Path

KV_DIR = Path(__file__).resolve().parents[2] / "kv"
WIDGETS_KV = ("tokens", "components", "fields", "lists", "rows", "dialogs", "pickers", "snackbar", "frame")


def load_kv(*names: str) -> None:
    """Load ``kv/<name>.kv`` for each name that is not loaded yet."""
    from kivy.lang import Builder

    for name in names:
        path = str(KV_DIR / f"{name}.kv")
        if path not in Builder.files:
            Builder.load_file(path)


def load() -> None:
    """Register all widgets and load their kv; once per process, before the first screen."""
    from app.widgets import (  # noqa: F401  (kivy's Factory learns the classes)
        buttons,
        chart,
        charts,
        dialogs,
        display,
        fields,
        frame,
        lists,
        long_list,
        pickers,
        robot_bars,
        robot_map,
        rows,
        snackbar,
        surfaces,
        text,
        timeline,
    )

    load_kv(*(f"widgets/{name}" for name in WIDGETS_KV))
