"""The app's own widgets, and how to use them. They depend on no service, and get all their texts from outside.

Call ``load()`` once before the first widget; then all kv knows the classes, the constants below, ``tk`` (the tokens) and ``tr`` (the
translator: ``tr._("Save")``). A screen's kv is loaded by its module: ``load_kv("home/screen")`` loads kv/home/screen.kv, once per process.

Colours and sizes
    ``tk.<colour>``        listed in tokens.py: bg surface surface2 line outline, ink ink2 ink3 (text, from strong to faint), accent…,
                           per tone (fault attention action done neutral offline accent)
                           ``<tone>``, ``<tone>_bg``, ``<tone>_on``, ``<tone>_solid``
    ``tk.h_touch h_field h_action``   least side of targets 48/64 dp, fields 56/64, the operator's buttons 64/120 (without/with gloves)
    MARGIN GAP PAD S4 S8 S12 S16 S24 R_CARD R_CTRL R_PILL CLEAR BAR_BESIDE     constants of tokens.kv
    Switch at run time: ``apply_theme(theme_cls, "light" | "dark" | "contrast", gloves=False)``. Colour marks abnormal states; a state is
    always icon, text and colour. At most one ``style: "filled"`` button per screen.

Text (labels as high as their lines; they wrap, and end with "…" only beyond ``most_lines``)
    Body BodyStrong (16) · Note NoteStrong (14) · Title Value (20) · BigValue ScreenTitle (24) · StateWord (28) · Kpi (36)
    ``fit: True`` as wide as its text (``max_width`` wraps it then) · ``Ico: icon: "wifi"`` ·
    ``Lines:`` texts below each other, centred in a row

Cards and facts (display.py)
    SectionCard · CardHead(title, note) · Tile · StatusBadge(tone, icon, text, loud) · Disc · ValueTile(icon, label, value, note,
    note_icon, level, mark, stale, tone) · Fact(label, value, icon, tone) · Notice(tone, icon, text, note) ·
    KpiCard(label, value, note, history) · EmptyState(icon, title, text, action, action_icon; on_release) · LegendItem(kind, text)

Buttons (buttons.py; ``on_release`` unless another event is given)
    CommandButton(style filled|tonal|outlined|text, tone, over_solid, icon, text, stacked, large, busy, fit, least_width) ·
    IconButton(icon, style standard|filled|tonal|outlined) · what destroys is ``outlined`` with ``tone: "fault"`` ·
    ChoiceChip(text, icon, active, limit) · MenuChip(text, trailing, active) · Toggle(active, controlled; on_switch(wanted)) ·
    Segments(options [(key, label)], selected; on_choose(key)) · Segment

Fields (fields.py; ``label`` above, ``help`` below, ``problem`` = one sentence that replaces the help in red)
    FormField(text, hint, kind text|int|decimal|url, password, max_length; on_commit(text), on_enter; show(text)) ·
    StepField(value, minimum, maximum, step, unit, optional; on_commit(value)) · PickField(label, value, icon, problem; on_release) ·
    SearchField(text, hint)

Lists (lists.py, long_list.py; rows are frozen dataclasses with the properties of the row class and a ``key``;
``on_action(key, action, *values)`` comes from the rows)
    Rows          all rows, in a box
    ScrollRows    some dozens; scrolls, comes to rest on whole rows; ``empty_text``; ``direction: "x"`` for a strip
    LongList      thousands; row classes mix in ``RecycledRow``; ``on_end`` asks for the next page
    PanelGrid     (panel_grid.py) panels side by side
    ScrollPage    a page or card that scrolls
    Existing rows (rows.py): RobotChip QueueRow PlanRow DoneRow NextStart ScheduleRow StoryStep LogRow SectionRow OptionRow
    New ones: ``class AlarmRow(Row, Toned, BoxLayout)`` with properties, a kv rule as high as its texts, and ``self.act("name")``.

Charts (chart.py, charts.py, timeline.py, robot_map.py)
    Meter Sparkline StackedBars RobotBars Timeline(on_bar(key), on_window(first, hours)) RobotMap Swatch AmrGlyph WorkingRing; a new one:
    subclass ``Chart``

Dialogs (dialogs.py, pickers.py; all are MDDialog; screens open them through ``app.screens.common.overlays.Dialogs``)
    FormDialog ConfirmDialog ChoiceDialog Menu TimeDialog DateDialog; new ones: see dialogs.py. ``Snackbars`` (snackbar.py): show, undo.

The frame (frame.py): ``Frame`` holds TopBar (an MDTopAppBar), AlarmBanner, Screens (an MDScreenManager) and NavBar (an MDNavigationBar);
built once by the window.

Pitfalls
    - Never name a property ``x`` and an event ``on_x``: kivy takes the event for the handler of the property.
    - A kv binding of a base rule stays active beside the one that overrides it: depend on the same properties, or use another property.
    - Class names must not exist in kivy's Factory (``Screen``, ``ActionButton``, ``Spinner`` …): the one registered first is used.
    - Widgets built by kv get their rule after ``__init__``; use ``self.ids`` in ``on_kv_post``.
    - Draw rounded shapes with ``Surface`` or ``rounded()``.
    - Fixed heights in dp cut texts off at font scale 1.3: use ``minimum_height`` or ``max(dp(48), lines.height + S8)``.
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
    """Cure KivyMD, register all widgets and load their kv; once per process, before the app is made."""
    from app.widgets import kivymd_cures

    kivymd_cures.apply()
    from app.widgets import (  # noqa: F401  (registers the classes in kivy's Factory)
        buttons,
        chart,
        charts,
        dialogs,
        display,
        fields,
        frame,
        lists,
        long_list,
        pages,
        pickers,
        robot_map,
        rows,
        snackbar,
        surfaces,
        text,
        timeline,
    )

    load_kv(*(f"widgets/{name}" for name in WIDGETS_KV))
