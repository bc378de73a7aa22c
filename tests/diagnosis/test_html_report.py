"""The report: one page that answers what, where, how sure, what changed and what could not be told, and needs nothing but itself."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.records.comparison import Explanation
from lathesim.diagnosis.records.diagnosis import BaselineValue, Determined, Interval, Location, MissingSignal
from lathesim.diagnosis.reporting.figures import missing_svg
from lathesim.diagnosis.reporting.html_report import _baseline, insert_lines, report_html
from lathesim.diagnosis.reporting.number_text import interval_texts, number, percent, quantity_text
from lathesim.diagnosis.reporting.summary import headline
from lathesim.diagnosis.reporting.wiring_diagram import wiring_diagram
from tests.diagnosis.sample_diagnoses import ALL, COULOMB, NAMED, UNKNOWN, WIRES, made, varied

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Page(HTMLParser):
    """Reads a page, refuses tags that are not closed, and keeps its tags, attributes and visible text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.words: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words).replace("\N{ZERO WIDTH SPACE}", ""))


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    return {name: report_html(diagnosis) for name, diagnosis in ALL.items()}


@pytest.mark.parametrize("name", ALL)
def test_every_verdict_makes_a_whole_page_that_needs_nothing_else(name: str, pages: dict[str, str]) -> None:
    page = Page(pages[name])
    assert headline(ALL[name]) in page.text
    assert page.tags.count("h1") == 1
    assert not {"script", "link", "img", "iframe", "object"} & set(page.tags)
    assert "@import" not in pages[name]
    outside = [value for key, value in page.attributes if key in ("src", "href", "xlink:href") and value and not value.startswith("#")]
    assert outside == []
    assert not [key for key, _ in page.attributes if key.startswith("on")]


@pytest.mark.parametrize("name", ALL)
def test_no_two_things_on_a_page_have_one_name_and_every_reference_is_there(name: str, pages: dict[str, str]) -> None:
    page = Page(pages[name])
    names = [value for key, value in page.attributes if key == "id"]
    assert len(names) == len(set(names))
    referred = set(re.findall(r"url\(#([^)]+)\)", pages[name])) | {v[1:] for k, v in page.attributes if k == "xlink:href" and v}
    assert referred <= set(names)


def test_the_page_of_a_named_effect_says_it_all(pages: dict[str, str]) -> None:
    text = Page(pages["named"]).text
    for said in (
        "CoulombFriction", "20.41 N", "20.22 to 20.60 N", "97.4 %", "98.3 %", "27 µm",
        "0.44 µm",
        "17 %", "4.3 %", "203.5 N·s/m", "410.2 N·s/m", "\N{MINUS SIGN}0.2 %", "The closest rival, AsymmetricFriction at x_axis",
        "7871",
        "it repeats with the position", "A current sensor", "x_encoder.position moves in steps of 50 nm",
        "insert: - {effect: CoulombFriction, at: x_axis, level: 20.41 N}",
    ):  # fmt: skip
        assert said in text, said


def test_the_suspect_is_the_red_box_of_the_wiring(pages: dict[str, str]) -> None:
    boxes = re.findall(r'<rect [^>]*fill="(#\w+)" stroke="#\w+"/>\n?<text [^>]*>([^<]+)</text>', pages["named"])
    fills = {name: fill for fill, name in boxes}
    assert len(fills) == 6
    assert {name: fill for name, fill in fills.items() if fill != "#ffffff"} == {"x_drive": "#fbe3e2", "x_axis": "#c0272d"}
    assert "#c0272d" not in {fill for fill, _ in re.findall(r'fill="(#\w+)" stroke="#(\w+)"/>', pages["no_mismatch"])}


def test_of_many_explanations_the_page_shows_what_was_kept_and_the_best_others() -> None:
    many = tuple(Explanation(f"Effect{place}", "x_axis", "effect", 100.0 + place, 1.0, 13.0, place == 0, "why") for place in range(20))
    text = Page(report_html(varied(NAMED, explanations=many))).text
    assert all(f"Effect{place} at x_axis" in text for place in (0, 9, 19))
    assert "Effect8 at" not in text
    assert "8 more stand in the table of lathesim diagnose --explain-decision." in text


def test_the_other_verdicts_say_what_is_theirs(pages: dict[str, str]) -> None:
    assert "A formula for what is left, empirical and unverified" in Page(pages["unknown"]).text
    assert "TorqueRipple at x_axis 12 1 12 no gains no more than chance could" in Page(pages["no_mismatch"]).text
    assert "The search was stopped before it had tried everything." in Page(pages["stopped"]).text
    assert "This recording cannot tell ForceOffset from ConverterOffset at x_drive." in Page(pages["tied"]).text
    fault = Page(pages["recording_fault"]).text
    assert "About the recording" in fault
    assert "What was found" not in fault
    assert "probability" not in fault
    assert re.sub(r"\s+", " ", UNKNOWN.rest.discovered) in Page(pages["unknown"]).text


def test_text_of_a_file_is_shown_and_never_obeyed() -> None:
    nasty = '<script>alert("x")</script>'
    evidence = replace(
        NAMED.evidence,
        wires=((nasty, "x_axis"), *WIRES),
        traces=tuple(replace(trace, channel=nasty) for trace in NAMED.evidence.traces[:1]),
        missing=tuple(replace(item, at=nasty) for item in NAMED.evidence.missing),
    )
    html = report_html(
        varied(
            UNKNOWN, sentence=nasty, lesson=nasty, recording=nasty, findings=(nasty,), left=(nasty,), discovered=nasty, evidence=evidence
        )
    )
    assert "<script" not in html
    assert Page(html).text.count(nasty) >= 7


def test_numbers_that_are_missing_are_shown_as_missing() -> None:
    parameters = {"level": Interval(20.0, "N", float("nan"), float("nan"))}
    unsure = replace(COULOMB, parameters=parameters, sizes=Determined(("level",)))
    bare = made(
        "named", "s", "l", "r", effects=(unsure,), location=Location(("x_axis",)),
    )  # fmt: skip
    text = Page(report_html(bare)).text
    assert "20 N (not determined here)" in text
    assert "nan" not in text.lower()


def test_a_page_is_the_same_each_time_and_of_reasonable_size(pages: dict[str, str]) -> None:
    assert report_html(NAMED) == pages["named"]
    long = np.arange(1_000_000) * 1e-3
    trace = replace(NAMED.evidence.traces[0], time=long, recorded=np.sin(long), before=np.cos(long), after=np.sin(long))
    html = report_html(replace(NAMED, evidence=replace(NAMED.evidence, traces=(trace,))))
    assert len(html) < 300_000


def test_the_template_goes_into_the_wheel() -> None:
    from lathesim.diagnosis.reporting import html_report as report

    assert (Path(report.__file__).parent / "report.html.j2").is_file()


@pytest.mark.parametrize(
    ("interval", "told"),
    [
        ((20.41234, 20.2219, 20.6, "N"), ("20.41 N", "20.22 to 20.60 N")),
        ((1.234e-5, 1.1e-5, 1.4e-5, "m"), ("12.3 µm", "11.0 to 14.0 µm")),
        ((203.4, 100.0, 300.0, "N*s/m"), ("203 N·s/m", "100 to 300 N·s/m")),
        ((-0.02, -0.03, -0.01, "1"), ("\N{MINUS SIGN}0.020", "\N{MINUS SIGN}0.030 to \N{MINUS SIGN}0.010")),
        ((5.0, float("-inf"), 7.0, "N"), ("5 N", "not determined here")),
        (
            (1.9086e-6, 1.9085e-6, 1.9087e-6, "kg*m^2"),
            ("1.90860e\N{MINUS SIGN}6 kg·m²", "1.90850e\N{MINUS SIGN}6 to 1.90870e\N{MINUS SIGN}6 kg·m²"),
        ),
        ((4.0, 4.0, 4.0, "1"), ("4", "narrower than its last digit")),
        ((4.812e-6, 4.73e-6, 4.89e-6, "kg*m^2"), ("4.812e\N{MINUS SIGN}6 kg·m²", "4.730e\N{MINUS SIGN}6 to 4.890e\N{MINUS SIGN}6 kg·m²")),
    ],
)
def test_an_interval_is_told_to_the_digits_it_carries(interval: tuple[float, float, float, str], told: tuple[str, str]) -> None:
    assert interval_texts(*interval) == told


def test_numbers_read_well() -> None:
    assert [percent(share) for share in (0.974, 1.0, 0.99973, 0.0, -0.5)] == ["97.4 %", "100 %", "> 99.9 %", "0 %", "\N{MINUS SIGN}50 %"]
    assert [quantity_text(value, "m") for value in (2.7e-5, 0.012, 4e-9)] == ["27 µm", "12 mm", "4 nm"]
    assert [number(value) for value in (0.0, 1234.5678, 1.5e-7, 2.0)] == ["0", "1235", "1.5e\N{MINUS SIGN}7", "2"]


def test_the_wiring_runs_from_the_controller_and_feedback_runs_below() -> None:
    diagram = wiring_diagram([pair for pair in WIRES if not pair[0].startswith("try")])
    assert diagram is not None
    place = {box.name: box.x for box in diagram.boxes}
    assert place["x_controller"] < place["x_dac"] < place["x_drive"] < place["x_axis"] < place["x_encoder"]
    assert (len(diagram.forward), len(diagram.back)) == (5, 2)
    assert all(box.x >= 0.0 and box.x + box.width <= diagram.width for box in diagram.boxes)


def test_of_a_large_machine_the_parts_near_the_suspect_are_drawn() -> None:
    chain = [(f"part_{number}", f"part_{number + 1}") for number in range(40)]
    diagram = wiring_diagram(chain, ["part_20"])
    assert diagram is not None
    assert {"part_19", "part_20", "part_21"} <= {box.name for box in diagram.boxes}
    assert diagram.left_out == 41 - len(diagram.boxes) > 20
    assert wiring_diagram([]) is None


@pytest.mark.parametrize(("before", "after", "off", "is_marked"), [(124.0, 124.0, "+24 %", True), (130.0, 100.5, "+0.5 %", False)])
def test_a_value_stands_beside_its_distance_from_the_lesson(before: float, after: float, off: str, is_marked: bool) -> None:
    """How far a value was before the effects says nothing of the value in the row."""
    row = _baseline("x_axis.mass", BaselineValue("kg", 100.0, before, after, after - 1.0, after + 1.0))
    assert row["with_it"].startswith(f"{after:g}")
    assert (row["off"], row["moved"]) == (off, is_marked)


def test_a_value_without_effects_is_shown_as_it_was_fitted_last() -> None:
    fitted = {"x_axis.mass": BaselineValue("kg", 400.0, 442.0, 520.0, 510.0, 530.0)}
    page = Page(report_html(replace(ALL["parameters_only"], baseline=fitted)))
    assert "+30 %" in page.words
    assert not any("442" in word for word in page.words)


def test_a_discovery_without_parameters_to_paste_shows_no_lines() -> None:
    assert insert_lines((), {}) == ""
    assert insert_lines(({"effect": "A", "at": "b"},), {"c": "motor"}) == "insert:\n  - {effect: A, at: b}\nside: {c: motor}"


def test_the_axes_of_what_is_missing_have_names_that_keep_apart() -> None:
    time = np.linspace(0.0, 6.0, 100)
    drawn = missing_svg(MissingSignal("spindle.disturbance", "N*m", time, 0.002 * time, 0.001 * time, 0.02 * time, 0.1, 0.05))
    upright = re.findall(r"translate\(([\d.]+) ([\d.]+)\) rotate\(-90\)\">([^<]+)<", drawn)
    wide = 0.55 * 9.0  # of a letter, in a font of 9 points
    spans = [(round(float(x)), float(y) - wide * len(text), float(y)) for x, y, text in upright]
    assert {"acts", "missing"} <= {text.split()[0] for _, _, text in upright}
    for line, begin, end in spans:
        assert not [other for at, other, last in spans if at == line and begin < last < end]
