"""The MTConnect agent, rule by rule of what clients lean on, asked by a client that shares no code with the source."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lathesim.live.channel_names import map_from
from lathesim.live.connections import Address
from lathesim.live.mtconnect_documents import Agent, DataItem, ObservationBuffer
from lathesim.live.mtconnect_publish import MOST_AGENTS, MOST_CONNECTIONS, Adapter, AgentServer, write_line
from lathesim.live.mtconnect_source import MTConnectSource
from lathesim.live.recording_run import record
from lathesim.live.samples import LiveError

START = datetime(2026, 1, 1, tzinfo=UTC)
X = DataItem("x1", "Xact", "SAMPLE", "POSITION", "MILLIMETER", "ACTUAL", ("Linear", "X"))
BLOCK = DataItem("b1", "block", "EVENT", "BLOCK", component=("Controller", "controller"))
TICK = DataItem("t1", "tick", "EVENT", "MESSAGE", component=("Controller", "controller"))
ALARM = DataItem("a1", "alarm", "CONDITION", "SYSTEM", component=("Controller", "controller"))


def agent(size: int = 100, instance: int = 7) -> Agent:
    """Return an agent with four items and an empty buffer."""
    return Agent("lathe", instance, ObservationBuffer([X, BLOCK, TICK, ALARM], size))


def filled(count: int, size: int = 100) -> Agent:
    """Return an agent that observed X at 0, 1, 2 ... mm, a millisecond apart."""
    made = agent(size)
    for number in range(count):
        made.buffer.observe(X, START + timedelta(milliseconds=number), str(number))
    return made


@asynccontextmanager
async def served(made: Agent, port: int = 0) -> AsyncIterator[tuple[AgentServer, int]]:
    """Serve an agent at a free port."""
    server = AgentServer(made)
    listening = await server.serve("127.0.0.1", port)
    try:
        yield server, listening.sockets[0].getsockname()[1]
    finally:
        listening.close()
        await server.close()


async def get(port: int, target: str, method: str = "GET") -> tuple[int, ElementTree.Element]:
    """Return the status and the document of an answer, tags without their namespace."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(f"{method} {target} HTTP/1.1\r\nHost: x\r\n\r\n".encode())
    whole = await asyncio.wait_for(reader.read(), 5.0)
    writer.close()
    head, _, body = whole.partition(b"\r\n\r\n")
    return int(head.split()[1]), plain(body)


def plain(document: bytes) -> ElementTree.Element:
    """Return a document with tags without their namespace."""
    root = ElementTree.fromstring(document)
    for element in root.iter():
        element.tag = element.tag.partition("}")[2]
    return root


def values(root: ElementTree.Element) -> list[tuple[int, str]]:
    """Return number and value of every observation."""
    return sorted((int(item.get("sequence", "0")), item.text or "") for item in root.iter() if item.get("dataItemId"))


async def test_current_is_the_newest_state_and_at_an_earlier_number_the_one_then() -> None:
    made = filled(5)
    made.buffer.observe(BLOCK, START, "N10")
    async with served(made) as (_, port):
        assert values((await get(port, "/current"))[1]) == [(5, "4"), (6, "N10")]
        assert values((await get(port, "/current?at=2"))[1]) == [(2, "1")]


async def test_current_at_knows_what_left_the_buffer() -> None:
    made = agent(10)
    made.buffer.observe(BLOCK, START, "N10")
    for number in range(30):
        made.buffer.observe(X, START, str(number))
    async with served(made) as (_, port):
        assert values((await get(port, "/current?at=22"))[1]) == [(1, "N10"), (22, "20")]


async def test_sample_goes_forward_from_a_number_and_back_with_a_negative_count() -> None:
    async with served(filled(20)) as (_, port):
        _, forward = await get(port, "/sample?from=5&count=3")
        _, back = await get(port, "/sample?from=9&count=-3")
        _, last = await get(port, "/sample?count=-2")
    assert values(forward) == [(5, "4"), (6, "5"), (7, "6")]
    assert forward.find("Header").get("nextSequence") == "8"  # type: ignore[union-attr]
    assert values(back) == [(7, "6"), (8, "7"), (9, "8")]
    assert values(last) == [(19, "18"), (20, "19")]


async def test_a_path_selects_items_and_the_cursor_passes_the_others() -> None:
    made = filled(3)
    made.buffer.observe(BLOCK, START + timedelta(seconds=1), "N20")
    async with served(made) as (_, port):
        _, blocks = await get(port, "/sample?path=//DataItem[@type='BLOCK']")
        _, linear = await get(port, "/current?path=//Linear")
        status, wrong = await get(port, "/current?path=//[[")
    assert values(blocks) == [(4, "N20")]
    assert blocks.find("Header").get("nextSequence") == "5"  # type: ignore[union-attr]
    assert values(linear) == [(3, "2")]
    assert (status, wrong.find("Errors/Error").get("errorCode")) == (400, "INVALID_XPATH")  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("target", "code"),
    [
        ("/sample?from=999", "OUT_OF_RANGE"),
        ("/sample?from=-1", "OUT_OF_RANGE"),
        ("/current?at=0", "OUT_OF_RANGE"),
        ("/sample?count=0", "OUT_OF_RANGE"),
        ("/sample?count=100000", "OUT_OF_RANGE"),
        ("/sample?interval=-5", "OUT_OF_RANGE"),
        ("/sample?from=soon", "INVALID_PARAMETER_VALUE"),
        ("/sample?count=1.5", "INVALID_PARAMETER_VALUE"),
        ("/current?at=3&interval=10", "INVALID_PARAMETER_VALUE"),
        ("/current?path=//Nothing", "INVALID_XPATH"),
        ("/asset/12/4", "NO_DEVICE"),
        ("/lathe/everything", "INVALID_URI"),
        ("/mill/current", "NO_DEVICE"),
    ],
)
async def test_what_cannot_be_answered_is_a_document_with_the_code_of_the_standard(target: str, code: str) -> None:
    async with served(filled(20)) as (_, port):
        status, root = await get(port, target)
    assert status in (400, 404)
    assert root.tag == "MTConnectError"
    assert root.find("Errors/Error").get("errorCode") == code  # type: ignore[union-attr]


def test_a_value_that_did_not_change_is_not_repeated() -> None:
    buffer = agent().buffer
    assert [buffer.observe(X, START, "1.5"), buffer.observe(X, START, "1.5"), buffer.observe(X, START, "1.6")] == [True, False, True]
    assert buffer.last_sequence == 2


def test_unavailable_is_said_once_when_the_source_is_lost() -> None:
    buffer = filled(2).buffer
    for _ in range(3):
        buffer.unavailable(START + timedelta(seconds=1))
    assert [(entry.item.id, entry.value) for entry in buffer.since(3, 100, None)[0]] == [
        (key, "UNAVAILABLE") for key in ("x1", "b1", "t1", "a1")
    ]


@pytest.mark.slow
@given(st.lists(st.integers(-1000, 1000), max_size=50))
def test_time_stamps_never_go_backwards_and_numbers_rise_by_one(milliseconds: list[int]) -> None:
    buffer = agent(20).buffer
    for at, offset in enumerate(milliseconds):
        buffer.observe(X, START + timedelta(milliseconds=offset), str(at))
    kept = buffer.since(buffer.first_sequence, 100, None)[0]
    assert [entry.sequence for entry in kept] == list(range(buffer.first_sequence, buffer.next_sequence))
    assert all(later.time >= earlier.time for earlier, later in itertools.pairwise(kept))


async def test_a_condition_is_an_element_by_its_level() -> None:
    made = agent()
    async with served(made) as (_, port):
        made.buffer.unavailable(START)
        assert [item.tag for item in (await get(port, "/current"))[1].find(".//Condition")] == ["Unavailable"]  # type: ignore[union-attr]
        made.buffer.observe(ALARM, START, "", "Normal")
        assert [item.tag for item in (await get(port, "/current"))[1].find(".//Condition")] == ["Normal"]  # type: ignore[union-attr]


async def test_streaming_sends_parts_of_their_own_length_and_an_empty_one_at_each_heartbeat() -> None:
    made = filled(2)
    async with served(made) as (_, port):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"GET /sample?from=1&interval=10&heartbeat=150 HTTP/1.1\r\n\r\n")
        head = await reader.readuntil(b"\r\n\r\n")
        assert b"multipart/x-mixed-replace;boundary=" in head
        parts = []
        for turn in range(3):
            piece = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 5.0)
            length = int(piece.lower().partition(b"content-length:")[2].split()[0])
            parts.append(values(plain(await reader.readexactly(length))))
            await reader.readexactly(2)
            if turn == 1:
                made.buffer.observe(X, START + timedelta(seconds=1), "77")
        writer.close()
    assert parts == [[(1, "0"), (2, "1")], [], [(3, "77")]]


async def test_a_request_that_is_none_is_answered_and_forgotten() -> None:
    async with served(filled(2)) as (_, port):
        assert (await get(port, "/probe", "POST"))[0] == 405
        assert (await get(port, "/" + "a" * 20_000))[0] == 431


def source_at(port: int, *pauses: float, item: str = "Xact") -> MTConnectSource:
    """Return the source of one item of an agent."""
    mapped = map_from({"channels": {"x_scale.position": {"item": item, "unit": "mm"}}}, "map")
    return MTConnectSource(Address("127.0.0.1", port), mapped, *pauses)


async def follow(source: MTConnectSource, until: int) -> tuple[list[float], list[str]]:
    """Return the values [mm] and notes of a source until so many values came."""
    found: list[float] = []
    notes: list[str] = []
    async for block in source.blocks():
        found += [1e3 * float(value) for value in block.values[0]]
        notes += block.notes
        if len(found) >= until:
            break
    return found, notes


async def test_a_cursor_that_fell_out_of_the_buffer_goes_on_and_says_what_was_lost() -> None:
    made = filled(5, 20)
    async with served(made) as (_, port):
        source = source_at(port, 0.1)

        async def more() -> None:
            await asyncio.sleep(0.05)  # the source has read up to number 5 and is waiting
            for number in range(5, 100):
                made.buffer.observe(X, START + timedelta(milliseconds=number), str(number))

        filling = asyncio.create_task(more())
        found, notes = await asyncio.wait_for(follow(source, 21), 10.0)
        await filling
    assert found == pytest.approx([4.0, *range(80, 100)])
    assert notes == ["75 observations were lost: the cursor fell out of the agent's buffer"]


async def test_another_instance_is_begun_anew() -> None:
    first, second = filled(3), agent(instance=8)
    for number in range(2):
        second.buffer.observe(X, START + timedelta(seconds=10 + number), str(50 + number))
    async with served(first) as (server, port):
        source = source_at(port, 0.05)

        async def restart() -> None:
            await asyncio.sleep(0.12)
            server.agent = second

        turning = asyncio.create_task(restart())
        found, notes = await asyncio.wait_for(follow(source, 3), 10.0)
        await turning
    assert found == pytest.approx([2.0, 50.0, 51.0])
    assert notes == ["the agent started anew"]


async def test_an_item_that_is_not_there_is_named_with_the_nearest() -> None:
    async with served(filled(1)) as (_, port):
        with pytest.raises(LiveError, match=r"has no data item 'Xat'\. Did you mean 'Xact'\?"):
            await anext(source_at(port, item="Xat").blocks())


async def test_an_adapter_sends_lines_of_shdr_to_an_agent_and_answers_its_pings() -> None:
    adapter = Adapter()
    server = await adapter.serve("127.0.0.1", 0)
    reader, writer = await asyncio.open_connection("127.0.0.1", server.sockets[0].getsockname()[1])
    writer.write(b"* PING\n")
    assert await asyncio.wait_for(reader.readline(), 5.0) == b"* PONG 10000\n"
    for number in range(20):
        adapter.send(write_line(START + timedelta(milliseconds=number), [("Xact", str(number)), ("block", "a|b\nc")]))
    lines = [(await asyncio.wait_for(reader.readline(), 5.0)).decode() for _ in range(20)]
    assert [line.split("|")[1:] for line in lines] == [["Xact", str(number), "block", "a b c\n"] for number in range(20)]
    assert lines[7].startswith("2026-01-01T00:00:00.007")
    server.close()
    await adapter.close()
    writer.close()


PROBE = b'<D xmlns="x"><Device><DataItem id="x1" name="Xact" category="SAMPLE" units="MILLIMETER"/></Device></D>'
GOOD = (
    b'<S><Header instanceId="1" firstSequence="1" lastSequence="1" nextSequence="2" bufferSize="9"/>'
    b'<P dataItemId="x1" sequence="1" timestamp="2026-01-01T00:00:00Z">5.0</P></S>'
)


def plain_answer(body: bytes) -> bytes:
    return b"HTTP/1.1 200 OK\r\n\r\n" + body


@asynccontextmanager
async def answering(*answers: bytes, hang: bool = False) -> AsyncIterator[int]:
    """Answer /probe properly and each further request with the next of the answers, the last one again and again."""
    waiting = list(answers)

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await reader.readuntil(b"\r\n\r\n")
        if head.startswith(b"GET /probe"):
            writer.write(plain_answer(PROBE))
        else:
            writer.write(waiting.pop(0) if len(waiting) > 1 else waiting[0])
        if hang and not head.startswith(b"GET /probe"):
            await reader.read()
        writer.close()

    server = await asyncio.start_server(answer, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()


@pytest.mark.parametrize(
    "answer",
    [
        plain_answer(GOOD.replace(b'nextSequence="2"', b'nextSequence="x"')),
        plain_answer(GOOD.replace(b'nextSequence="2"', b'nextSequence="-5"')),
        plain_answer(GOOD.replace(b'bufferSize="9"', b'bufferSize="' + b"9" * 5000 + b'"')),
        plain_answer(GOOD.replace(b'sequence="1" t', b'sequence="1e3" t')),
        plain_answer(b"<not xml"),
        plain_answer(b'<E><Error errorCode="INTERNAL_ERROR">no</Error></E>'),
        plain_answer(b""),
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nZZ\r\nabc\r\n0\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n-5\r\nabc\r\n0\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nX: " + b"a" * 70_000 + b"\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Length: 999999999\r\n\r\nshort",
        b"nonsense",
        b"",
    ],
)
async def test_a_malformed_answer_is_an_agent_that_is_away_until_it_answers_well(answer: bytes) -> None:
    async with answering(answer, plain_answer(GOOD)) as port:
        source = source_at(port, 0.01, 0.01)
        found, notes = await asyncio.wait_for(follow(source, 1), 10.0)
    assert found == [5.0]
    assert notes[0].startswith("the agent went away: ")
    assert notes[1:] == ["the agent was away"]


async def test_a_recording_stops_at_once_while_an_agent_sends_nothing_more(tmp_path: Path) -> None:
    async with answering(b"HTTP/1.1 200 OK\r\nContent-Length: 50\r\n\r\n<", hang=True) as port:
        source = source_at(port, 0.01)
        stop = asyncio.Event()
        recording = asyncio.create_task(record(source, tmp_path / "r.h5", 1e4, stop, lambda _: None))
        await asyncio.sleep(0.05)
        stop.set()
        noted = await asyncio.wait_for(recording, 2.0)
    assert (noted.samples, noted.status) == (0, "stopped")


@pytest.mark.parametrize(
    "target", ["//[", "/" + "a/" * 500, "/%00%01probe", "/\x01", "/current?path=" + "//*" * 1000, "/current?path=" + "/.." * 39]
)
async def test_a_hostile_request_is_answered_with_an_error_document(target: str) -> None:
    async with served(filled(3)) as (_, port):
        status, root = await get(port, target)
        assert (await get(port, "/probe"))[0] == 200
    assert status in (400, 404)
    assert root.tag == "MTConnectError"


async def test_connections_beyond_the_bound_are_closed_and_the_others_served() -> None:
    async with served(filled(3)) as (_, port):
        waiting = [await asyncio.open_connection("127.0.0.1", port) for _ in range(MOST_CONNECTIONS)]
        reader, beyond = await asyncio.open_connection("127.0.0.1", port)
        assert await asyncio.wait_for(reader.read(), 5.0) == b""
        for _, writer in [*waiting, (reader, beyond)]:
            writer.close()


async def test_an_agent_that_is_gone_gets_no_more_lines_and_further_agents_are_refused(caplog: pytest.LogCaptureFixture) -> None:
    adapter = Adapter()
    server = await adapter.serve("127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    connected = [await asyncio.open_connection("127.0.0.1", port) for _ in range(MOST_AGENTS)]
    reader, beyond = await asyncio.open_connection("127.0.0.1", port)
    assert await asyncio.wait_for(reader.read(), 5.0) == b""
    for _, writer in [*connected[1:], (reader, beyond)]:
        writer.transport.abort()
    for number in range(300):
        adapter.send(write_line(START, [("Xact", str(number))]))
        await asyncio.sleep(0)
    assert b"|Xact|0" in await asyncio.wait_for(connected[0][0].readline(), 5.0)
    connected[0][1].close()
    server.close()
    await adapter.close()
    assert caplog.records == []


async def test_a_server_that_closes_under_a_stream_logs_nothing(caplog: pytest.LogCaptureFixture) -> None:
    async with served(filled(2)) as (_, port):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"GET /sample?from=1&interval=10 HTTP/1.1\r\n\r\n")
        await reader.readuntil(b"MTConnectStreams>")
        reading = asyncio.create_task(reader.read())
    await asyncio.wait_for(reading, 5.0)
    await asyncio.sleep(0)
    assert caplog.records == []
    writer.close()


async def test_probe_lists_the_items_and_headers_have_every_attribute_that_the_schemas_require() -> None:
    common = {"version", "creationTime", "instanceId", "sender", "bufferSize"}
    required = {
        "/probe": common | {"deviceModelChangeTime", "assetBufferSize", "assetCount"},
        "/mill": common,
        "/current": common | {"deviceModelChangeTime", "firstSequence", "lastSequence", "nextSequence"},
    }
    async with served(filled(3)) as (_, port):
        _, root = await get(port, "/probe")
        headers = {target: (await get(port, target))[1].find("Header") for target in required}
    assert {item.get("name") for item in root.iter("DataItem")} == {"Xact", "block", "tick", "alarm"}
    assert {target: set(header.attrib) for target, header in headers.items() if header is not None} == required
    told = {"instanceId": "7", "bufferSize": "100", "firstSequence": "1", "lastSequence": "3", "nextSequence": "4"}
    assert told.items() <= headers["/current"].attrib.items()  # type: ignore[union-attr]
