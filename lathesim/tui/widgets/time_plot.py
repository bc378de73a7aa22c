"""A plot over time of chosen channels of one or more records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.markup import escape
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid
from textual.content import Content
from textual.message import Message
from textual.strip import Strip
from textual_hires_canvas import Canvas, TextAlign
from textual_plot import HiResMode, PlotWidget
from textual_plot.axis_formatter import NumericAxisFormatter
from textual_plot.plot_widget import Legend, LinePlot

from lathesim.analysis.display_unit import plain_name, pretty_unit
from lathesim.analysis.figure_style import DrawnLine, PlotPicture
from lathesim.record import FloatArray
from lathesim.tui.drawing.canvas import BRAILLE, axis_ticks, braille_codes, even_axis, labels_of, trace
from lathesim.tui.drawing.curves import Curve, PlotLine, Scaled, look_of, power_beside, range_of, said_once, scaled

FIGURE_POINTS = 3000
"""Columns to which a curve is thinned in a figure: more than the dots across a page."""
_LOW = 12
"""Rows below which the margins are made smaller."""
_COLUMNS_A_TICK, _ROWS_A_TICK = 12, 2
_ROOM = 0.05
"""Share of the range of values that stays free above and below."""


class _StyledCanvas(Canvas):
    """A canvas whose segments all have a style: without colours (``NO_COLOR``) the app's filter asks each for it."""

    def render_line(self, y: int) -> Strip:
        strip = super().render_line(y)
        if all(segment.style is not None for segment in strip):
            return strip
        return Strip([Segment(segment.text, segment.style or Style.null(), segment.control) for segment in strip], strip.cell_length)


class _Ticks(NumericAxisFormatter):
    """Marks of an axis: no more than there is room for."""

    most = 5
    is_bare = False
    """Whether nothing is drawn, so that the axis measures nothing."""
    even: tuple[float, float, list[float]] | None = None
    """Limits and the marks that lie evenly between them; other limits have their own marks."""

    def get_ticks_and_labels(self, min_: float, max_: float, max_ticks: int = 8) -> tuple[list[float], list[str]]:
        if self.is_bare:
            return [], []
        if self.even is not None and self.even[:2] == (min_, max_):
            return self.even[2], labels_of(self.even[2])
        return axis_ticks(min_, max_, self.most)


class TimePlot(PlotWidget, inherit_bindings=False):
    """Draws curves, each thinned to the width of the widget; the legend names channel and unit.

    Curves differ in colour and in the shape of their dots. Zoom with + and - or the wheel, pan with the arrows or the mouse, ``r`` resets.
    """

    BINDINGS = [
        Binding("+,equals_sign", "zoom_in", "Zoom in", show=False),
        Binding("-", "zoom_out", "Zoom out", show=False),
        Binding("ctrl+left", "zoom_x_out", "Wider in time", show=False),
        Binding("ctrl+right", "zoom_x_in", "Nearer in time", show=False),
        Binding("ctrl+up", "zoom_y_in", "Nearer in value", show=False),
        Binding("ctrl+down", "zoom_y_out", "Wider in value", show=False),
        Binding("left", "pan_left", "Earlier", show=False),
        Binding("right", "pan_right", "Later", show=False),
        Binding("up", "pan_up", "Up", show=False),
        Binding("down", "pan_down", "Down", show=False),
        Binding("r", "reset_scales", "Reset", show=False),
    ]

    DEFAULT_CSS = """
    TimePlot { border-top: solid $secondary; border-title-align: right; border-title-color: $foreground; }
    TimePlot > .plot--tick, TimePlot > .plot--label { color: $foreground; text-style: none; }
    """

    class Picked(Message):
        """A person clicked at ``x`` of the axis along."""

        def __init__(self, x: float) -> None:
            super().__init__()
            self.x = x

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self._names_shown: tuple[list[str], str] = ([], "")
        self._says_unit = True
        """Whether the names say the unit; otherwise it stands before them where the plot is low."""
        self._values: tuple[float, float] | None = None
        self._pressed_at: tuple[int, int] | None = None
        self._drawn: list[Scaled | PlotLine] = []
        self._about: tuple[str, ...] = ()
        """What the axes show; of each such view ``_zooms`` keeps the limits that a person has set."""
        self._zooms: dict[tuple[str, ...], tuple[tuple[float, float] | None, ...]] = {}
        self._across, self._up = _Ticks(), _Ticks()
        self.set_x_formatter(self._across)
        self.set_y_formatter(self._up)

    def compose(self) -> ComposeResult:
        """Return the canvases of the plot and its margins."""
        with Grid():
            for name in ("margin-top", "margin-left", "plot", "margin-bottom"):
                yield _StyledCanvas(1, 1, id=name)
        yield Legend(id="legend")

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Return whether a key may act: in a plot that was not drawn yet there is nothing to move, and no room to measure it by."""
        return bool(self._scale_rectangle) and super().check_action(action, parameters)

    @property
    def named(self) -> list[tuple[str, str, str]]:
        """The curves as they are drawn: mark, name, colour."""
        looks = [look_of(place) for place in range(len(self._names_shown[0]))]
        return [(look.mark, name, look.colour(self._is_dark)) for look, name in zip(looks, self._names_shown[0], strict=True)]

    @property
    def span(self) -> tuple[float, float]:
        """The ends of the axis along."""
        return self._x_min, self._x_max

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Remember where the button went down: a click there is no drag."""
        self._pressed_at = event.screen_x, event.screen_y

    def on_mouse_up(self, event: events.MouseUp) -> None:
        """Post where the plot was clicked."""
        if self._pressed_at == (event.screen_x, event.screen_y):
            canvas = self.query_one("#plot")
            x = event.screen_x - canvas.region.x
            if 0 <= x < canvas.size.width:
                self.post_message(self.Picked(self.get_coordinate_from_pixel(x, 1)[0]))
        self._pressed_at = None

    def on_resize(self) -> None:
        """Fit the curves to the room there is."""
        self.margin_top, self.margin_bottom, self.margin_left = (0, 2, 9) if self._is_low else (1, 2, 9)
        self._across.most = max(2, self.size.width // _COLUMNS_A_TICK)
        self._up.most = max(2, self._rows // _ROWS_A_TICK)
        self._name_curves()
        self.call_after_refresh(self._fit_canvases)

    @property
    def _rows(self) -> int:
        """Rows between the lower and the upper edge of the frame."""
        return self.size.height - self.margin_top - self.margin_bottom - 2

    @property
    def _is_low(self) -> bool:
        return self.size.height < _LOW

    @property
    def _is_dark(self) -> bool:
        return self.app.current_theme.dark

    def notify_style_update(self) -> None:
        """Draw anew in the colours of another theme."""
        super().notify_style_update()
        if self.is_mounted:
            self._name_curves()

    def _render_line_plot(self, dataset: LinePlot) -> None:
        """Draw a line in braille, broken as its look says; where lines meet the later one stands in front."""
        canvas = self.query_one("#plot", Canvas)
        size = canvas._canvas_size  # its buffer, which a new layout fits only after this
        width, height = (size.width - 2, size.height - 2) if size is not None else (0, 0)
        if width < 1 or height < 1 or not len(dataset.x):
            return
        place = next(place for place, other in enumerate(self._datasets) if other is dataset)
        look = look_of(place)
        x, y = self._in_view(self._drawn[place], 2 * width)
        dots = np.zeros((4 * height, 2 * width), dtype=bool)
        across = (x - self._x_min) / (self._x_max - self._x_min) * (2.0 * width - 1.0)
        up = (y - self._y_min) / (self._y_max - self._y_min) * (4.0 * height - 1.0)
        trace(dots, across + 0.5, up + 0.5, dash=look.dash)
        codes = braille_codes(dots)
        colour = look.colour(self._is_dark)
        for row, column in np.argwhere(codes > 0).tolist():
            canvas.set_pixel(column + 1, row + 1, chr(BRAILLE + int(codes[row, column])), style=colour)

    def _render_x_label(self) -> None:
        """Write the label of the axis along below its marks."""
        margin = self.query_one("#margin-bottom", Canvas)
        style = self.get_component_rich_style("plot--label")
        margin.write_text(self.size.width // 2, self.margin_bottom - 1, f"[{style}]{escape(self._x_label)}", TextAlign.CENTER)

    def _render_y_label(self) -> None:
        """Write the label of the axis up at the left end of the row above the plot."""
        margin = self.query_one("#margin-top", Canvas)
        margin.reset()
        style = self.get_component_rich_style("plot--label")
        margin.write_text(1, 0, f"[{style}]{escape(self._y_label)}", TextAlign.LEFT)

    def _fit_canvases(self) -> None:
        """Draw anew once the margins have their new sizes; an axis up that a person has set stays."""
        if self._up.even is not None and self._up.even[:2] == (self._y_min, self._y_max):
            self._fit_rows()
        self.refresh(layout=True)
        self._rerender()

    def show(
        self,
        curves: Sequence[Curve],
        *,
        span: tuple[float, float] | None = None,
        cursor: float | None = None,
        fit_to_feed: bool = False,
        about: str = "",
    ) -> None:
        """Draw curves. ``span`` [s] bounds the time axis; ``cursor`` [s] stands as a line.

        With ``fit_to_feed`` the value axis spans what happened in the cut, or else in blocks run at feed, where the record tells; rapid
        moves may leave the frame. Axes that a person has set stay as long as the channels and what the plot is ``about`` are the same.
        """
        if not self.query(Legend):
            return  # it does not stand yet
        with self.app.batch_update():
            self._keep_zoom((about, *dict.fromkeys(curve.channel for curve in curves)))
            self.clear()
            units: list[str] = []
            labels: list[tuple[str, str]] = []
            self._drawn = []
            for curve, item in scaled(curves, fit_to_feed=fit_to_feed):
                units.append(item.unit)
                largest = max(
                    (abs(end) for other in self._drawn if isinstance(other, Scaled) for end in (other.low, other.high)), default=0.0
                )
                power = power_beside(largest, max(abs(item.low), abs(item.high)), set(units))
                times = f" x{power:g}" if power != 1.0 else ""
                labels.append((f"{curve.title or plain_name(curve.channel)} [{pretty_unit(item.unit) or '1'}]{times}", curve.run))
                self._draw(item.times(power), max(10, 2 * (self.size.width - self.margin_left)))
            ends = self._ends()
            self._fit(span, (min(ends), max(ends)) if ends else None)
            self.set_xlabel("t / s" if units else "")
            self.set_ylabel(pretty_unit(units[0]) or "1" if len(set(units)) == 1 else "")
            if cursor is not None and units:
                self.add_v_line(cursor, line_style="grey50")
            before, names = said_once(labels)
            self._show_names(names, before, says_unit=True)

    def _draw(self, item: Scaled | PlotLine, columns: int) -> None:
        self._drawn.append(item)
        self.plot(*item.points(columns), hires_mode=HiResMode.BRAILLE)

    def _ends(self) -> list[float]:
        """Return the limits of the visible parts of all curves drawn so far."""
        return [end for item in self._drawn if isinstance(item, Scaled) for end in (item.low, item.high)]

    def _in_view(self, item: Scaled | PlotLine, columns: int) -> tuple[FloatArray, FloatArray]:
        """Return what is drawn between the ends of the axis along: of a part that is zoomed to, each sample that there is room for."""
        x, y = item.within(self._x_min, self._x_max).points(columns)
        finite = np.isfinite(x) & np.isfinite(y)
        return x[finite], y[finite]

    def picture(self) -> PlotPicture:
        """Return the contents of the plot with its current limits, for a figure."""
        looks = [look_of(place) for place in range(len(self._drawn))]
        before, names = self._names_shown[1], self._names_shown[0]
        lines = [
            DrawnLine(*self._in_view(item, FIGURE_POINTS), name, look.on_light, look.dash)
            for item, name, look in zip(self._drawn, names, looks, strict=True)
        ]
        limits = (self._x_min, self._x_max), (self._y_min, self._y_max)
        cursor = next((line.x for line in self._v_lines), None)
        return PlotPicture(tuple(lines), self._x_label, before or self._y_label, *limits, cursor)

    def show_cursors(self, *places: float | None) -> None:
        """Move the cursors and leave everything else as it is."""
        self._v_lines.clear()
        self._v_lines_labels.clear()
        for place in places:
            if place is not None:
                self.add_v_line(place, line_style="grey50")

    def show_values(self, low: float, high: float) -> None:
        """Show the axis up from ``low`` to ``high`` in its unit."""
        self._auto_y_min = self._auto_y_max = False
        self._y_min, self._y_max = low, high
        self._rerender()

    def show_lines(self, lines: Sequence[PlotLine], x_label: str, y_label: str) -> None:
        """Draw lines of any two quantities; the axes fit all of them."""
        if not self.query(Legend):
            return  # it does not stand yet
        with self.app.batch_update():
            self._keep_zoom((x_label, y_label))
            self.clear()
            self._drawn = []
            for line in lines:
                self._draw(line, 2 * self.size.width)
            self._fit(None, range_of([line.y for line in lines]))
            self.set_xlabel(x_label)
            self.set_ylabel(y_label)
            self._show_names([line.title for line in lines], says_unit=False)

    def _show_names(self, names: list[str], before: str = "", *, says_unit: bool) -> None:
        """Name the curves above the plot, with ``before`` in front; what has not changed costs no new layout."""
        self._across.is_bare = self._up.is_bare = not names
        self._says_unit = says_unit
        if (names, before) != self._names_shown:
            self._names_shown = (names, before)
            self._name_curves()

    def _name_curves(self) -> None:
        before = self._names_shown[1]
        y_label = self._y_label if self._is_low and not self._says_unit else ""
        words = [Content(word) for word in (y_label, before) if word]
        words += [Content.styled(f"{mark} {name}", colour) for mark, name, colour in self.named]
        self.border_title = Content("  ").join(words)

    def _keep_zoom(self, about: tuple[str, ...]) -> None:
        """Remember the axes that a person has set, before something else is shown."""
        x, y = (self._x_min, self._x_max), (self._y_min, self._y_max)
        by_hand_x = not self._auto_x_min if self._user_x_min is None else x != (self._user_x_min, self._user_x_max)
        by_hand_y = not self._auto_y_min if self._user_y_min is None else y != (self._user_y_min, self._user_y_max)
        self._zooms[self._about] = x if by_hand_x else None, y if by_hand_y else None
        self._about = about

    def _zoom_again(self) -> None:
        """Set the axes as a person had them, unless nothing would be seen of a shorter run."""
        x, y = self._zooms.get(self._about, (None, None))
        if x is not None:
            fitted, (self._x_min, self._x_max) = (self._x_min, self._x_max), x
            if any(len(self._in_view(item, 2)[0]) for item in self._drawn):
                self._auto_x_min = self._auto_x_max = False
            else:
                self._x_min, self._x_max = fitted
        if y is not None:
            self.show_values(*y)

    def _fit(self, span: tuple[float, float] | None, values: tuple[float, float] | None) -> None:
        self.set_xlimits(*(span or (None, None)))
        if values is None:
            self.set_ylimits(None, None)
        else:
            low, high = values
            room = _ROOM * (high - low) or abs(high) or 1.0
            self._values = low - room, high + room
            self._fit_rows()
        self._zoom_again()

    def _fit_rows(self) -> None:
        """Let the marks of the axis up fall into the middle of rows."""
        if self._values is not None:
            self._up.even = even_axis(*self._values, self._rows)
            self.set_ylimits(*self._up.even[:2])
