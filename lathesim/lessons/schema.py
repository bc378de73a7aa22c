"""What may stand in a lesson and in a machine template, as pydantic models; the same models give the JSON Schema for editors.

Quantities stay text here (``"0.25 V/mm"``): which unit is expected is known only once the machine is put together.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AliasChoices, BaseModel, ConfigDict, Field, PlainValidator, WithJsonSchema, model_validator
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import PydanticCustomError, core_schema

from lathesim.lessons.yaml_source import kind_of


def _quantity(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return repr(value)
    raise PydanticCustomError("quantity", "{found} stands here, and a quantity is expected, for example '5 ms'.", {"found": kind_of(value)})


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    raise PydanticCustomError("text", "{found} stands here, and a text is expected.", {"found": kind_of(value)})


Quantity = Annotated[
    str,
    PlainValidator(_quantity),
    WithJsonSchema({"type": ["string", "number"], "description": "number and unit, e.g. '5 ms'; a pure number only where the unit is 1"}),
]


def _unit(value: Any) -> str:
    """Take a unit; the 1 of a pure number needs no quotes."""
    return "1" if type(value) is int and value == 1 else _text(value)


def _steps(value: Any) -> tuple[str, ...]:
    if isinstance(value, (list, tuple)):
        return tuple(_text(item) for item in value)
    return (_text(value),) if value != "" else ()


Text = Annotated[str, PlainValidator(_text), WithJsonSchema({"type": "string"})]
Steps = Annotated[
    tuple[str, ...], PlainValidator(_steps), WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]})
]
"""A hint, or several that open one after the other."""
PartItem = Annotated[str, Field(pattern=r"^[A-Za-z_]\w*\.[A-Za-z_]\w*$")]
Unit = Annotated[str, PlainValidator(_unit), WithJsonSchema({"anyOf": [{"type": "string"}, {"const": 1}]})]
"""A unit, as 'mm/s'; 1 for a pure number."""
Count = Annotated[int, Field(strict=True, ge=1)]
Side = Literal["motor", "load"]
CourseUnit = Literal["basics", "contour", "cutting and force", "part programs", "chatter", "detective", "advanced"]
"""The units of the course, in their order."""


def _there(*keys: str) -> dict[str, Any]:
    """Return the JSON Schema of a mapping in which all ``keys`` have a value."""
    return {"required": list(keys), "properties": {key: {"not": {"type": "null"}} for key in keys}}


def _without(*keys: str) -> dict[str, Any]:
    """Return the JSON Schema of a mapping in which none of ``keys`` has a value."""
    return {"not": {"anyOf": [_there(key) for key in keys]}}


def _together(first: str, second: str) -> dict[str, Any]:
    """Return the JSON Schema of a mapping that has both keys or neither."""
    return {"anyOf": [_there(first, second), _without(first, second)]}


class FileModel(BaseModel):
    """What a file of a person may say: keys that are known, each of its type."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class PartEntry(FileModel):
    """A part of a machine: which component it is and what differs from the component's defaults."""

    component: Text
    file: Text | None = Field(default=None, description="of 'component: FMU': the file among the plug-ins")
    units: dict[str, Text] = Field(default_factory=dict, description="what stands for the {placeholders} in the component's units")
    set: dict[str, Quantity] = Field(default_factory=dict, description="parameter -> quantity")
    start: dict[str, Quantity] = Field(default_factory=dict, description="state -> quantity at the beginning")
    every: Count = Field(default=1, description="sampled at each n-th sample instant of the machine")
    memory: dict[str, Count] = Field(default_factory=dict, description="memory -> length")
    side: Side | None = Field(default=None, description="of a sensor: on which side of a spring it sits")


class Travel(FileModel):
    """How far a machine reaches (X is a radius) and how fast it feeds; without an entry there is no limit."""

    x_low: Quantity | None = None
    x_high: Quantity | None = None
    z_low: Quantity | None = None
    z_high: Quantity | None = None
    feed: Quantity | None = None


class StartPoint(FileModel):
    """Where the tool stands when a program begins (X is a radius)."""

    x: Quantity
    z: Quantity


class ToolEntry(FileModel):
    """A tool of the turret, for nose compensation; ``orientation`` says where its point lies from the centre of the nose, 1 to 9."""

    nose_radius: Quantity
    orientation: Annotated[int, Field(strict=True, ge=0, le=9)] = 3


UNKNOWN = 10.0
"""Standard deviation of a value, in values, from which on a lesson says that nothing is known of it: not even how many digits it has."""
_ALARMS = "output -> its largest magnitude, as '50 mm', or its range, as '-100..500 mm'; beyond it the run stops"


class MachineSettings(FileModel):
    """A machine template: parts and wires."""

    machine: Text = Field(description="title")
    text: Text = ""
    parts: dict[str, PartEntry]
    wires: dict[PartItem, Quantity] = Field(default_factory=dict, description="input -> output that feeds it (part.name), or a quantity")
    finish: Text = Field(default="", description="output that ends the run when it exceeds 0.5")
    sample_period: Quantity
    step: Quantity
    record: list[PartItem] | None = Field(default=None, description="channels to record; all outputs where it is left out")
    travel: Travel = Field(default_factory=Travel)
    alarms: dict[PartItem, Quantity] = Field(default_factory=dict, description=_ALARMS)
    start_point: StartPoint | None = Field(
        default=None, description="where the tool stands at first; the dialect's place where it is left out"
    )


def _with_effect_or_remedy(schema: dict[str, Any]) -> None:
    """Accept ``remedy`` as another name of ``effect``, as the alias of the field does."""
    schema["properties"]["remedy"] = schema["properties"]["effect"]
    schema["required"].remove("effect")
    schema["oneOf"] = [_there("effect"), _there("remedy")]


class InsertEntry(BaseModel):
    """An effect put on a wire. Further keys are its parameters, start values and the sources of its inputs."""

    model_config = ConfigDict(extra="allow", frozen=True, json_schema_extra=_with_effect_or_remedy)
    __pydantic_extra__: dict[str, Quantity]
    effect: Text = Field(validation_alias=AliasChoices("effect", "remedy"), description="an effect, or a remedy")
    at: Text = Field(description="a part, or part.name: an input, parameter or output")
    name: Text = ""
    every: Count = 1

    @model_validator(mode="before")
    @classmethod
    def _is_one(cls, data: Any) -> Any:
        if isinstance(data, dict) and "effect" in data and "remedy" in data:
            raise PydanticCustomError("insert", "'effect' and 'remedy' exclude each other. Write one of them.")
        return data


class Goal(FileModel):
    """What a run of the lesson shall reach."""

    model_config = ConfigDict(json_schema_extra={"anyOf": [_there("at_most"), _there("at_least")]})

    metric: Text
    at_most: Quantity | None = None
    at_least: Quantity | None = None
    hint: Steps = ()

    @model_validator(mode="after")
    def _has_a_limit(self) -> Goal:
        if self.at_most is None and self.at_least is None:
            raise PydanticCustomError("goal", "the goal has no limit. Write at_most or at_least with a quantity.")
        return self


class LessonQuestion(FileModel):
    """A question about the runs of a lesson: one of ``choices``, or a number with a unit, right ``within`` a tolerance.

    The answer stands there in clear, or sealed as 'lathesim check' seals it.
    """

    model_config = ConfigDict(
        json_schema_extra={"allOf": [{"oneOf": [_there("choices"), _there("within")]}, {"oneOf": [_there("answer"), _there("sealed")]}]}
    )

    ask: Text
    choices: list[Text] | None = Field(default=None, min_length=1, description="what can be chosen")
    within: Quantity | None = Field(default=None, description="tolerance of a number, with its unit")
    answer: Quantity | None = None
    sealed: Text | None = Field(default=None, description="digest of the answer")

    @model_validator(mode="after")
    def _is_whole(self) -> LessonQuestion:
        if (self.choices is None) == (self.within is None):
            raise PydanticCustomError("question", "a question has either 'choices' or a tolerance, 'within'. Write one of them.")
        if (self.answer is None) == (self.sealed is None):
            raise PydanticCustomError("question", "a question has either an 'answer' or a 'sealed' one. Write one of them.")
        return self


class TimeColumn(FileModel):
    """When the rows of a recording were taken."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [_there("column"), _there("rate")]})

    column: Text | None = None
    unit: Text = "s"
    rate: Quantity | None = None
    mean_of: Count = Field(default=1, description="so many rows are averaged to one sample, for recordings finer than the model")

    @model_validator(mode="after")
    def _has_one(self) -> TimeColumn:
        if (self.column is None) == (self.rate is None):
            raise PydanticCustomError("time", "the time needs exactly one of 'column' and 'rate'.")
        return self


class ColumnEntry(FileModel):
    """A column of a recording and what it means."""

    column: Text
    unit: Unit
    scale: float = Field(default=1.0, strict=True)
    resolution: Quantity | None = None


class DrivingSignal(ColumnEntry):
    """A column that drives an input, or one that tells when the input is on: it is ``value`` from where the column rises through ``above``
    until it falls through ``until_below``, and 0 elsewhere."""

    model_config = ConfigDict(
        json_schema_extra={
            "allOf": [
                _together("above", "value"),
                {"anyOf": [_there("above"), _without("until_below", "lasting")]},
                {"anyOf": [_without("above"), _without("resolution")]},
            ]
        }
    )

    above: Quantity | None = Field(default=None, description="level of the column, in its unit, from which on the input is on")
    value: Quantity | None = Field(default=None, description="what the input is then; 0 while it is off")
    until_below: Quantity | None = Field(default=None, description="level below which it is off again; as 'above' where it is left out")
    lasting: Quantity | None = Field(default=None, description="a crossing counts only if the column stays there so long; 10 ms")
    held: bool | None = Field(
        default=None,
        strict=True,
        description="whether a value is held until the next row, as a command is; a measured force is interpolated",
    )

    @model_validator(mode="after")
    def _is_whole(self) -> DrivingSignal:
        if (self.above is None) != (self.value is None):
            missing, there = ("above", "value") if self.above is None else ("value", "above")
            raise PydanticCustomError("switch", f"'{there}' without '{missing}'. Write both, as in above: 60 N, value: 1 mm.")
        if self.above is None and (self.until_below is not None or self.lasting is not None):
            raise PydanticCustomError("switch", "'until_below' and 'lasting' go with 'above' and 'value'. Write those, or leave these out.")
        if self.above is not None and self.resolution is not None:
            raise PydanticCustomError("switch", "an input that is only on or off has no resolution. Leave it out.")
        return self


class Recordings(FileModel):
    """How the columns of a recording map to the machine."""

    file: Text | None = None
    time: TimeColumn
    drive: dict[PartItem, DrivingSignal] = Field(default_factory=dict, description="input -> signal that replaces what feeds it")
    compare: dict[PartItem, ColumnEntry] = Field(default_factory=dict, description="output -> signal it is held against")


class ModeEntry(FileModel):
    """A mode of the tool point."""

    frequency: Quantity
    damping: Quantity
    stiffness: Quantity
    direction: Quantity = "0 deg"


class ResponseEntry(FileModel):
    """A measured frequency response of the tool point."""

    file: Text = Field(description="CSV, MAT or UFF 58, beside the lesson")
    quantity: Literal["receptance", "mobility", "accelerance"] | None = None
    unit: Text | None = Field(default=None, description="where the file gives none, as 'g/N'")
    direction: Quantity = "0 deg"


class MillingEntry(FileModel):
    """Milling with straight teeth, in place of a turning cut."""

    teeth: Count
    tangential: Quantity = Field(description="tangential force per chip area, as '600 N/mm^2'")
    normal: Quantity = Field(description="normal force per chip area")
    entry: Quantity = Field(default="0 deg", description="angle at which a tooth enters the cut")
    leave: Quantity = Field(default="180 deg", description="angle at which it leaves the cut")


class TapEntry(FileModel):
    """How the tool point is tapped with a hammer."""

    hits: Count = 5
    peak: Quantity = "800 N"
    scatter: Quantity = "10 %"
    contact: Quantity = "0.4 ms"
    rate: Quantity = "12.8 kHz"
    length: Quantity = "2 s"
    force_noise: Quantity = "0.5 N"
    sensor: Literal["displacement", "velocity", "acceleration"] = "displacement"
    noise: Quantity | None = Field(default=None, description="noise of the sensor, as '2 nm' or '0.05 m/s^2'")
    double_hits: Quantity = Field(default="10 %", description="chance that the hammer bounces")
    range: Quantity = Field(default="5 kN", description="largest force that the hammer reads")


class ToolPointEntry(FileModel):
    """What decides whether a cut chatters: the modes of the tool point, its measured response or its parts, and the cut that excites it."""

    model_config = ConfigDict(
        json_schema_extra={
            "allOf": [
                {"oneOf": [{"required": ["modes"], "properties": {"modes": {"minItems": 1}}}, _there("response"), _there("assembly")]},
                {"anyOf": [_there("cutting_stiffness"), _there("milling")]},
                _together("speed", "width"),
            ]
        }
    )

    modes: list[ModeEntry] = Field(default_factory=list)
    response: ResponseEntry | None = None
    assembly: Text | None = Field(default=None, description="an assembly file, as of 'lathesim couple'")
    cutting_stiffness: Quantity | None = Field(default=None, description="force per chip area, as '700 N/mm^2'")
    force_angle: Quantity = Field(default="0 deg", description="angle of the cutting force from the surface normal")
    process_damping: Quantity = Field(default="0 N/m", description="force per width and slope of the surface")
    diameter: Quantity = Field(default="36 mm", description="diameter at which it cuts, for the process damping")
    interrupted: Quantity = Field(default="1", description="share of each turn in which a slotted bar is in the cut")
    milling: MillingEntry | None = None
    tap: TapEntry = TapEntry()
    speed: Quantity | None = Field(default=None, description="speed of the lesson's cut, shown on the map")
    width: Quantity | None = Field(default=None, description="chip width of the lesson's cut, shown on the map")

    @model_validator(mode="after")
    def _has_one_source(self) -> ToolPointEntry:
        if sum((bool(self.modes), self.response is not None, self.assembly is not None)) != 1:
            raise PydanticCustomError("tool_point", "the tool point needs exactly one of 'modes', 'response' and 'assembly'.")
        if self.cutting_stiffness is None and self.milling is None:
            raise PydanticCustomError("tool_point", "the cut has no 'cutting_stiffness'. Write one, as '700 N/mm^2', or 'milling:'.")
        if (self.speed is None) != (self.width is None):
            raise PydanticCustomError("tool_point", "the lesson's cut has a speed and a width. Write both, or neither.")
        return self


class Changes(FileModel):
    """What a lesson or one of its variants changes of the machine."""

    program: Text | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] | None = None
    duration: Quantity | None = Field(default=None, description="length of the run where no output ends it")
    set: dict[PartItem, Quantity] = Field(default_factory=dict, description="part.parameter or part.state -> quantity")
    replace: dict[str, Text] = Field(default_factory=dict, description="part -> component that takes its place")
    add: dict[str, PartEntry] = Field(default_factory=dict, description="parts beside those of the machine; 'wires' connects them")
    units: dict[str, dict[str, Text]] = Field(
        default_factory=dict, description="part -> what stands for the {placeholders} in its units, instead of the machine's"
    )
    insert: list[InsertEntry] = Field(default_factory=list, description="effects, in the order in which they act")
    wires: dict[PartItem, Quantity] = Field(default_factory=dict, description="input -> part.output or a quantity; adds or replaces a wire")
    every: dict[str, Count] = Field(default_factory=dict, description="part -> sampled at each n-th sample instant")
    side: dict[str, Side] = Field(default_factory=dict, description="sensor -> on which side of a spring it sits, motor or load")
    alarms: dict[PartItem, Quantity] = Field(default_factory=dict, description=_ALARMS)
    tables: dict[PartItem, Text] = Field(default_factory=dict, description="part.table -> CSV file of numbers, beside the lesson")


class Variant(Changes):
    """A case of a lesson: the lesson with a few changes."""

    text: Text = ""
    published: dict[str, Quantity] = Field(default_factory=dict, description="metric -> value printed in the literature, shown beside")
    breaks_down: bool = Field(default=False, strict=True, description="the case shows how a machine breaks down; that is no fault")


class LessonSettings(Changes):
    """A lesson: a machine, a part program, what is changed, what is to be learned."""

    lesson: Text = Field(description="title")
    text: Text = Field(default="", description="what it is about, in Markdown")
    try_: list[Text] = Field(default_factory=list, alias="try", description="what to try")
    unit: CourseUnit | None = Field(default=None, description="unit of the course")
    after: list[Text] = Field(default_factory=list, description="names of the lessons that must come before")
    minutes: Count | None = Field(default=None, description="about how long the lesson takes")
    level: Literal["beginner", "intermediate", "advanced"] | None = None
    learn: Text = Field(default="", description="one or two sentences about what is learnt")
    machine: Text = Field(description="name or path of a machine template")
    dialect: Text = "paper"
    tools: dict[Annotated[int, Field(ge=1)], ToolEntry] = Field(
        default_factory=dict,
        description="tool number -> its nose, for G41 and G42",
        json_schema_extra={"propertyNames": {"pattern": r"^0*[1-9]\d*$"}},
    )
    engine: Literal["auto", "plain", "compiled"] = "auto"
    sample_period: Quantity | None = None
    step: Quantity | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = 1
    record: list[PartItem] | None = None
    published: dict[str, Quantity] = Field(default_factory=dict)
    plot: list[PartItem] = Field(default_factory=list, description="channels that the plot of the app shows at first")
    read_outs: list[PartItem] = Field(default_factory=list, description="channels that the read-outs of the app begin with")
    variants: dict[str, Variant] = Field(default_factory=dict)
    goals: list[Goal] = Field(default_factory=list)
    questions: list[LessonQuestion] = Field(default_factory=list, description="what the app asks about the runs, and 'grade' counts")
    start_point: StartPoint | None = Field(default=None, description="where the tool stands at first, instead of the machine's")
    recordings: Recordings | None = None
    tool_point: ToolPointEntry | None = Field(default=None, description="tool point and cut, for 'lathesim lobes', 'tap' and 'cuts'")
    uncertain: dict[PartItem, Quantity] = Field(default_factory=dict, description="one standard deviation, as '5 %' or a quantity")


class _Strict(GenerateJsonSchema):
    """JSON Schema in which a mapping has only keys that match its pattern."""

    def dict_schema(self, schema: core_schema.DictSchema) -> JsonSchemaValue:
        """Return the schema of a mapping; pydantic itself accepts keys that match no pattern."""
        found = super().dict_schema(schema)
        return {**found, "additionalProperties": False} if "patternProperties" in found else found


def json_schema(kind: str = "lesson") -> dict[str, Any]:
    """Return the JSON Schema of a lesson or of a machine template."""
    model: type[BaseModel] = MachineSettings if kind == "machine" else LessonSettings
    schema = model.model_json_schema(by_alias=True, schema_generator=_Strict)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": f"lathesim-{kind}/1", **schema}
