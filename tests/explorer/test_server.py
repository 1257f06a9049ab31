"""The server: who may ask, what is answered, and that nothing else happens."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numba
import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest, HTTPResponse
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.websocket import WebSocketClientConnection, websocket_connect

from designer import InputError, explore, parse_model_file, read_model_file
from designer.base.jit import compilation_watched
from designer.explorer.explorer_page import page
from designer.explorer.questions import read_question
from designer.explorer.server import Explorer, application
from designer.explorer.work_queue import WorkQueue
from tests.explorer.served import EXAMPLES
from tests.shared.model_text import PAPER_TABLE

HOSTILE = "</script><script>alert(1)</script>"
WIRES: list[WebSocketClientConnection] = []
"""Sockets that a visit has opened; closed at its end."""
Visit = Callable[[int], Awaitable[Any]]


def visiting(
    visit: Visit, tmp_path: Path, token: str = "", host: str = "127.0.0.1", model: str = "paper"
) -> Any:
    """What a visitor of a server finds; the server stands in this process."""
    modelfile = read_model_file(EXAMPLES / f"{model}.toml")

    async def both() -> Any:
        queue = WorkQueue()
        explorer = Explorer(modelfile, queue, tmp_path, host, token)
        server = HTTPServer(application(explorer))
        sockets = bind_sockets(0, "127.0.0.1")
        server.add_sockets(sockets)
        try:
            return await visit(sockets[0].getsockname()[1])
        finally:
            while WIRES:
                WIRES.pop().close()
            server.stop()
            await server.close_all_connections()
            await asyncio.sleep(0.05)  # a client's socket closes when it sees the server's end
            explorer.close()

    result = asyncio.run(both())
    assert list(tmp_path.iterdir()) == []
    return result


async def get(port: int, path: str = "/", **headers: str) -> HTTPResponse:
    request = HTTPRequest(f"http://127.0.0.1:{port}{path}", headers=headers)
    return await AsyncHTTPClient(force_instance=True).fetch(request, raise_error=False)


async def socket(port: int, query: str = "", **headers: str) -> WebSocketClientConnection:
    request = HTTPRequest(f"http://127.0.0.1:{port}/socket{query}", headers=headers)
    request.url = request.url.replace("http", "ws", 1)
    WIRES.append(await websocket_connect(request))
    return WIRES[-1]


async def answer(wire: WebSocketClientConnection, kind: str, **words: object) -> dict[str, Any]:
    """The first answer of a kind to a question about these words."""
    await wire.write_message(json.dumps({"kind": "view", "id": 5, "words": words}))
    while True:
        text = await wire.read_message()
        assert text is not None
        message: dict[str, Any] = json.loads(text)
        if message["kind"] == kind:
            assert message["id"] == 5
            return message


def test_the_page_and_its_files_load_nothing_from_elsewhere(tmp_path: Path) -> None:
    async def visit(port: int) -> list[HTTPResponse]:
        return [await get(port, f"/{name}") for name in ("", "explore.css", "explore.js")]

    for response in visiting(visit, tmp_path):
        assert response.code == 200
        text = response.body.decode("utf-8")
        assert "http://" not in text.replace("http://www.w3.org", "")
        assert "https://" not in text
        assert "default-src 'none'" in response.headers["Content-Security-Policy"]


@pytest.mark.parametrize("query", ["?K.f4=1.7", "?map=K.f4~omega~~~~"])
def test_a_point_of_a_law_in_the_address_has_a_slider(tmp_path: Path, query: str) -> None:
    """Its page reads what its sliders are named after, and nothing else."""

    async def visit(port: int) -> list[str]:
        return [(await get(port, f"/{each}")).body.decode("utf-8") for each in ("", query)]

    plain, asked = visiting(visit, tmp_path, model="two-wells-chaos")
    assert 'data-name="K.f4"' not in plain
    assert 'data-name="K.f4"' in asked
    assert asked.count("data-name=") == plain.count("data-name=") + 1


def test_a_question_is_answered_and_a_bad_one_too(tmp_path: Path) -> None:
    async def visit(port: int) -> list[dict[str, Any]]:
        wire = await socket(port)
        view = await answer(wire, "view", omega="0.85")
        error = await answer(wire, "error", k0="2")
        strip = await answer(wire, "strip", omega="0.85")
        return [view, error, strip]

    view, error, strip = visiting(visit, tmp_path)
    assert view["response"] == "1-2-2"
    assert "k0" in error["text"]
    assert "Traceback" not in error["text"]
    assert set(strip["data"]) == {"omega", "x", "period"}


def test_a_page_is_told_while_kernels_are_compiled(tmp_path: Path) -> None:
    """Once for a kernel with its callees, and not where nothing is compiled."""
    explorer = Explorer(read_model_file(EXAMPLES / "paper.toml"), WorkQueue(), tmp_path, "", "")
    told: list[Any] = []

    class Wire:
        send = staticmethod(told.append)

    explorer.sockets.add(Wire())  # type: ignore[arg-type]
    with compilation_watched(explorer.tell_compiling):
        inner = numba.njit(lambda x: x + 1)
        outer = numba.njit(lambda x: inner(x) * 2)
        assert outer(3) == 8
        assert outer(4) == 10
    numba.njit(lambda x: x - 1)(1)
    explorer.close()
    assert [(m["kind"], m["on"]) for m in told] == [("compiling", True), ("compiling", False)]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        '{"kind": "save", "id": 1}',
        '{"kind": "eval", "id": 1, "words": {}}',
        '{"kind": "view", "id": "1", "words": {}}',
        "\0",
    ],
)
def test_what_is_no_question_closes_the_socket(text: str, tmp_path: Path) -> None:
    assert read_question(text) is None

    async def visit(port: int) -> str | bytes | None:
        wire = await socket(port)
        await wire.write_message(text)
        return await wire.read_message()

    assert visiting(visit, tmp_path) is None


def test_only_this_machine_under_its_own_names_is_answered(tmp_path: Path) -> None:
    """Another site's script cannot ask, by a name of its own for this address or as its origin."""

    async def visit(port: int) -> tuple[int, int, int]:
        local = await get(port, Host=f"localhost:{port}")
        foreign = await get(port, Host=f"evil.example:{port}")
        with pytest.raises(HTTPClientError) as caught:
            await socket(port, Origin="http://evil.example")
        return local.code, foreign.code, caught.value.code

    assert visiting(visit, tmp_path) == (200, 403, 403)


def test_an_address_of_version_six_is_answered_under_its_own_name(tmp_path: Path) -> None:
    """A browser writes it in brackets, with the port behind them or without."""

    async def visit(port: int) -> list[int]:
        names = (f"[::1]:{port}", "[::1]", f"[::2]:{port}", f"[evil.example]:{port}")
        return [(await get(port, Host=name)).code for name in names]

    assert visiting(visit, tmp_path, host="::1") == [200, 200, 403, 403]


def test_a_token_is_asked_for_and_then_kept_as_a_cookie(tmp_path: Path) -> None:
    async def visit(port: int) -> list[Any]:
        without, wrong = await get(port), await get(port, "/?token=secreT")
        right = await get(port, "/?token=secret", Host="box.example:80")
        cookie = right.headers["Set-Cookie"].split(";")[0]
        again = await get(port, "/", Cookie=cookie)
        with pytest.raises(HTTPClientError):
            await socket(port)
        view = await answer(await socket(port, Cookie=cookie), "view")
        return [without.code, wrong.code, right.code, again.code, view["kind"]]

    assert visiting(visit, tmp_path, "secret", "0.0.0.0") == [403, 403, 200, 200, "view"]


def test_a_wrong_path_is_told_in_a_line(tmp_path: Path) -> None:
    async def visit(port: int) -> list[HTTPResponse]:
        paths = (
            "/nothing",
            "/report/x",
            "/report/..%2Fx",
            "/../pyproject.toml",
            "/templates/explore.js",
            "/explore.html.j2",
        )
        return [await get(port, path) for path in paths]

    for response in visiting(visit, tmp_path):
        assert response.code == 404
        assert len(response.body) < 200


def test_a_title_cannot_leave_its_place() -> None:
    text = page(parse_model_file(f'format = 1\ntitle = "{HOSTILE}"\n{PAPER_TABLE}'))
    assert HOSTILE not in text
    assert "alert(1)" in text


@pytest.mark.parametrize(
    "words",
    [
        {"port": 70000},
        {"port": -5},
        {"host": "192.0.2.7"},
    ],
)
def test_an_address_that_is_none_is_refused(words: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="--port"):
        explore(EXAMPLES / "paper.toml", browser=False, **words)
