"""The lathe view: the half section of the part while it is turned."""

from __future__ import annotations

import numpy as np
from rich.segment import Segment
from rich.style import Style
from textual.content import Content
from textual.strip import Strip
from textual.widget import Widget

from lathesim.analysis.display_unit import pretty_quantities
from lathesim.errors import LatheSimError
from lathesim.tui.drawing.canvas import ACTUAL, CENTRE, CHUCK, CUT, EDGE, LABEL, NOTHING, REFERENCE, TOOL, LathePicture, draw_waves
from lathesim.tui.drawing.lathe_picture import LatheScene, ToolMotion, View, draw
from lathesim.units import in_unit

_CLASSES = {
    NOTHING: "lathe--label",
    REFERENCE: "lathe--reference",
    ACTUAL: "lathe--actual",
    TOOL: "lathe--tool",
    LABEL: "lathe--label",
    EDGE: "lathe--edge",
    CUT: "lathe--cut",
    CENTRE: "lathe--label",
    CHUCK: "lathe--chuck",
}


class LatheView(Widget):
    """Shows a scene and the motion up to a sample; drawn anew when :meth:`show` is called or the size changes."""

    COMPONENT_CLASSES = {"lathe--material", *_CLASSES.values()}
    DEFAULT_CSS = """
    LatheView {
        background: $background;
        & > .lathe--material { background: #46607a; color: #ffffff; }
        & > .lathe--cut { color: #589d8b; }
        & > .lathe--chuck { color: #94a3b8; }
        & > .lathe--edge { color: #46607a; }
        & > .lathe--reference { color: #fbbf24; }
        & > .lathe--actual { color: #6ee7a0; text-style: bold; }
        & > .lathe--tool { color: #f87171; text-style: bold; }
        & > .lathe--label { color: $foreground; }
        &:light > .lathe--material { background: #b9c9d9; color: #1f1f1f; }
        &:light > .lathe--cut { color: #709c8f; }
        &:light > .lathe--chuck { color: #64748b; }
        &:light > .lathe--edge { color: #b9c9d9; }
        &:light > .lathe--reference { color: #92400e; }
        &:light > .lathe--actual { color: #166534; text-style: bold; }
        &:light > .lathe--tool { color: #b91c1c; text-style: bold; }
    }
    """

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self._scene = LatheScene(None, np.empty(0), np.empty(0))
        self._motion: ToolMotion | None = None
        self._until = 0
        self._view = View()
        self._picture: LathePicture | None = None

    @property
    def view(self) -> View:
        """How the scene is looked at."""
        return self._view

    @view.setter
    def view(self, view: View) -> None:
        self._view = view
        self._draw_anew()

    @property
    def picture(self) -> LathePicture | None:
        """The picture as it was last drawn; None where there is no room for one."""
        if self._picture is None and self.size.width > 0 and self.size.height > 0:
            if self._scene.is_empty:
                self._picture = self._waves()
                return self._picture
            self._picture = draw(self._scene, self._motion, self._until, self.size.width, self.size.height, self._view)
        return self._picture

    def _waves(self) -> LathePicture | None:
        """Return the end of the part with its waves, None where the machine cuts none."""
        if self._scene.record is None:
            return None
        from lathesim.analysis.turned_part import waves_on_part

        try:
            waves = waves_on_part(self._scene.record, self._until or None, turns=1)
        except LatheSimError:
            return None
        return draw_waves(waves, self.size.width, self.size.height)

    def on_mount(self) -> None:
        """Show above the picture what its lines are."""
        self._name_lines()

    def _name_lines(self) -> None:
        if self.is_mounted:
            words = "Half section" if not self._scene.is_empty or self._scene.record is None else "End of the part, waves magnified"
            self.border_title = Content("  ").join([Content(words), *(Content.styled(*line) for line in self._lines())])

    def _lines(self) -> list[tuple[str, str]]:
        """Return the lines of the picture as they are drawn, with their names and colours."""
        named = (("⠒⠂⠐ reference", REFERENCE), ("⠒⠒⠒ actual", ACTUAL))
        return [(words, self.get_component_styles(_CLASSES[layer]).color.hex) for words, layer in named]

    def show(self, scene: LatheScene, motion: ToolMotion | None = None, until: int | None = None) -> None:
        """Show a scene with the motion up to a sample, the last where it is left out."""
        self._scene, self._motion = scene, motion
        self._until = len(motion) if motion is not None and until is None else until or 0
        self._name_lines()
        self._draw_anew()

    def notify_style_update(self) -> None:
        """Draw anew in the colours of another theme."""
        super().notify_style_update()
        self._draw_anew()
        self.call_after_refresh(self._name_lines)

    def on_resize(self) -> None:
        """Draw anew in another size."""
        self._draw_anew()

    def _draw_anew(self) -> None:
        self._picture = None
        if self.is_attached:
            self.border_subtitle = self._legend()
            self.refresh()

    def _legend(self) -> str:
        picture = self.picture
        if picture is None:
            return ""
        if self._scene.is_empty:
            return f"a dot is {pretty_quantities(in_unit(picture.dot, 'um', '.2g'))} of a wave" if picture.dot > 0.0 else ""
        measure = "diameter" if self._view.as_diameter else "radius"
        gain = f"error x{self._view.gain:g}, " if self._view.gain != 1.0 else ""
        return f"{gain}X as {measure}, dot {in_unit(picture.dot, 'mm', '.2g')}"

    def render_line(self, y: int) -> Strip:
        """Return one row of the picture."""
        picture = self.picture
        width = self.size.width
        ground = self.rich_style
        if picture is None or y >= picture.text.shape[0] or picture.text.shape[1] != width:
            words = "This machine turns no part." if self._scene.is_empty and y == self.size.height // 2 else ""
            return Strip([Segment(words[:width].center(width), ground)], width)
        layer, material, text = picture.layer[y], picture.material[y], picture.text[y]
        begins = np.flatnonzero(np.append(True, np.diff(layer * 2 + material) != 0))
        ends = np.append(begins[1:], width)
        segments = []
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
            segments.append(Segment("".join(text[begin:end]), self._style(int(layer[begin]), bool(material[begin]), ground)))
        return Strip(segments, width)

    def _style(self, layer: int, material: bool, ground: Style) -> Style:
        within = self.get_component_rich_style("lathe--material", partial=True)
        background = within.bgcolor if material else ground.bgcolor
        colour = within if material and _CLASSES[layer] == "lathe--label" else self.get_component_rich_style(_CLASSES[layer], partial=True)
        return Style(color=colour.color, bgcolor=background, bold=colour.bold)
