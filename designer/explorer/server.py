"""The server of the page."""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import re
import secrets
import socket
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from designer.base import jit
from designer.base.errors import InputError
from designer.base.progress import Progress
from designer.explorer.board_box import PartsProcess
from designer.explorer.explorer_page import ASSETS, asset, page
from designer.explorer.folder_losses import FolderLosses, folder_losses
from designer.explorer.job_processes import JobProcesses
from designer.explorer.questions import boards, planes, read_question, save_model, viewed
from designer.explorer.wire import Message, text_of
from designer.explorer.work_queue import DEFECT, WorkQueue
from designer.model.model_file import ModelFile

PORT = 8610
"""Port where none is asked for; another one where it is taken."""
MOST_PORT = 65_535
LOCAL = frozenset({"127.0.0.1", "localhost", "::1"})
"""Addresses that no other machine reaches; written as in an address (``_written``), the names by
which a browser may call them."""
TOKEN = re.compile(r"[A-Za-z0-9_.~-]{1,200}")
"""What stands in an address and in a cookie as it is."""
LARGEST = 65_536
"""Bytes of one message from a page."""
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
REPORT_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content policy of a report, which is one file with scripts of its own."""
TYPES = {"css": "text/css", "js": "text/javascript", "html": "text/html"}


@dataclass
class Explorer:
    """What all pages of one server share."""

    modelfile: ModelFile
    queue: WorkQueue
    """The thread that computes."""
    root: Path
    """The folder below which it writes."""
    host: str
    """Address that the server is bound to."""
    token: str
    """What a page has to know; "" where any page on this machine may ask."""
    report: Callable[[BaseException], None] = lambda _: None
    """Told of defects that a page's question met."""
    losses: FolderLosses | None = None
    """What the model's folder says of rare losses."""
    sockets: set[_Socket] = field(default_factory=set)
    """The open pages."""
    compiling: bool = False
    """Whether a kernel is being compiled, which a picture then waits for."""

    @cached_property
    def jobs(self) -> JobProcesses:
        """The jobs that pages have started."""
        return JobProcesses(self._tell)

    @cached_property
    def board_queue(self) -> WorkQueue:
        """The thread that waits for parts and counts boards: a picture does not wait for it."""
        return WorkQueue(self.report)

    @cached_property
    def parts(self) -> PartsProcess:
        """The process that chooses parts."""
        return PartsProcess()

    def tell_compiling(self, module: str | None) -> None:
        """Tell every page, also later ones, that kernels are compiled; None : no more."""
        self.compiling = module is not None
        self._tell({"kind": "compiling", "on": self.compiling})

    def _tell(self, message: Message) -> None:
        """What every page is told."""
        for socket_ in tuple(self.sockets):
            socket_.send({**message, "id": -1})

    def close(self) -> None:
        """End the thread and the jobs."""
        self.jobs.close()
        self.parts.close()
        self.board_queue.close()
        self.queue.close()

    @property
    def local(self) -> bool:
        """Whether only this machine reaches the server."""
        return self.host in LOCAL


def serve(
    modelfile: ModelFile,
    *,
    port: int | None,
    host: str,
    token: str | None,
    browser: bool,
    ready: Callable[[str], None],
    progress: Progress,
) -> None:
    """Serve the page until Ctrl-C. What a page asks to be written goes below the folder that this
    was started in.

    port : ``PORT``, or any free one where that is taken. token : without one it is drawn. ready :
    is given the page's address.

    Raises
    ------
    InputError : a port that is taken, an address that is none here.
    """
    if token is None:
        token = "" if host in LOCAL else secrets.token_urlsafe(16)
    elif not TOKEN.fullmatch(token):
        raise InputError(None, "--token", token, "letters, digits, _, -, . and ~, at most 200")
    losses = folder_losses(modelfile, progress.note)
    listening = _listening(host, port)
    number = listening.getsockname()[1]
    address = _address(host, number, token)

    def report(error: BaseException) -> None:
        progress.note(f"a page's question failed: {type(error).__name__}: {error}")

    explorer = Explorer(modelfile, WorkQueue(report), Path.cwd(), host, token, report, losses)

    def started() -> None:
        progress.note(f"{address} shows {modelfile.title}; Ctrl-C ends it")
        progress.idle()
        if browser:
            webbrowser.open(address)
        ready(address)

    with contextlib.suppress(KeyboardInterrupt), jit.compilation_watched(explorer.tell_compiling):
        asyncio.run(_serve(explorer, listening, started))
    explorer.close()


def application(explorer: Explorer) -> Application:
    """The pages and the socket of a server."""
    with_explorer = {"explorer": explorer}
    names = "|".join(name.replace(".", r"\.") for name in ASSETS)
    return Application(
        [
            ("/", _Page, with_explorer),
            (f"/({names})", _Asset, with_explorer),
            ("/socket", _Socket, with_explorer),
            ("/report/([^/]+)", _Report, with_explorer),
        ],
        websocket_max_message_size=LARGEST,
        websocket_ping_interval=20,
        log_function=lambda _: None,
    )


def _listening(host: str, port: int | None) -> socket.socket:
    """A listening socket; at any free port where none is asked for and the usual one is taken."""
    if port is not None and not 0 <= port <= MOST_PORT:
        raise InputError(None, "--port", port, f"a number from 0 to {MOST_PORT}")
    try:
        host.encode("idna")
    except UnicodeError:
        raise InputError(None, "--host", host, "an address or a name of this machine") from None
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in (PORT, 0) if port is None else (port,):
        try:
            made = socket.create_server((host, number), family=family)
            made.setblocking(False)
            return made
        except OSError as error:
            reason = error.strerror or str(error)
    where = f"{host} port {PORT if port is None else port} ({reason})"
    raise InputError(None, "--host, --port", where, "an address of this machine and a free port")


def _address(host: str, port: int, token: str) -> str:
    return f"http://{_written(host)}:{port}/" + (f"?token={token}" if token else "")


def _written(host: str) -> str:
    """A host as it stands in an address and in the header Host: IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host


async def _serve(explorer: Explorer, listening: socket.socket, started: Callable[[], None]) -> None:
    server = HTTPServer(application(explorer), max_body_size=LARGEST)
    server.add_socket(listening)
    started()
    try:
        await asyncio.Event().wait()
    finally:
        server.stop()


class _Guarded(RequestHandler):
    """A request that is answered only where it may be."""

    open_to_all = False

    def initialize(self, explorer: Explorer) -> None:
        self.explorer = explorer

    def prepare(self) -> None:
        """Refuse a name that another site gave this machine, and a page without the token."""
        name = self.request.host_name
        if self.explorer.local and name not in map(_written, LOCAL):
            raise HTTPError(403, "this server is asked under another name than it has")
        if not self.open_to_all and not self._knows():
            raise HTTPError(403, "the address needs ?token=… as the terminal shows it")

    def _knows(self) -> bool:
        token = self.explorer.token
        if not token:
            return True
        given = self.get_query_argument("token", "") or self.get_cookie(self._cookie, "") or ""
        return hmac.compare_digest(given.encode("utf-8"), token.encode("utf-8"))

    @property
    def _cookie(self) -> str:
        """Cookies are one for all ports of a host."""
        return f"explore_{self.request.connection.stream.socket.getsockname()[1]}"  # type: ignore[union-attr]

    def set_default_headers(self) -> None:
        self.set_header("Content-Security-Policy", POLICY)
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Cache-Control", "no-cache")
        self.clear_header("Server")

    def write_error(self, status_code: int, **words: Any) -> None:
        """One line of text; never a traceback."""
        error = words.get("exc_info", (None, None, None))[1]
        reason = error.log_message if isinstance(error, HTTPError) and error.log_message else None
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(reason or (DEFECT if status_code >= 500 else "there is nothing here"))


class _Page(_Guarded):
    def get(self) -> None:
        if self.explorer.token:
            self.set_cookie(
                self._cookie, self.explorer.token, httponly=True, samesite="Strict", path="/"
            )
        asked = [*self.request.query_arguments, *self.get_query_argument("map", "").split("~")]
        self.write(page(self.explorer.modelfile, self.explorer.losses, asked))


class _Asset(_Guarded):
    open_to_all = True

    def get(self, name: str) -> None:
        self.set_header("Content-Type", f"{TYPES[name.rsplit('.')[-1]]}; charset=utf-8")
        self.write(asset(name))


class _Report(_Guarded):
    """The report of a job that a page started."""

    def get(self, name: str) -> None:
        path = self.explorer.jobs.report(name)
        if path is None:
            raise HTTPError(404, "no job that this page started has such a report")
        self.set_header("Content-Security-Policy", REPORT_POLICY)
        self.write(path.read_bytes())


class _Socket(WebSocketHandler, _Guarded):
    """One open page."""

    def open(self, *_: str) -> None:
        self.set_nodelay(True)
        self._loop = IOLoop.current()
        self.explorer.sockets.add(self)
        for message in self.explorer.jobs.messages:
            self.send(message)
        if self.explorer.compiling:
            self.send({"kind": "compiling", "on": True, "id": -1})

    def on_message(self, message: str | bytes) -> None:
        question = read_question(message)
        if question is None:
            self.close(1003, "a question of another kind")
            return
        e = self.explorer
        if question.kind == "view":
            answer = partial(viewed, e.modelfile, question)
            e.queue.ask(self, question.number, answer, self.send)
        elif question.kind in ("map", "borders"):
            answer = partial(planes, e.modelfile, question)
            e.queue.ask(self, question.number, answer, self.send, "map")
        elif question.kind == "board":
            answer = partial(boards, e.modelfile, e.parts, question)
            e.board_queue.ask(self, question.number, answer, self.send)
        else:  # beside the picture, whose next question shall not overtake it
            answer = partial(save_model, e.modelfile, e.root, e.jobs, question)
            e.queue.ask((self, "save"), question.number, answer, self.send)

    def on_close(self) -> None:
        self.explorer.sockets.discard(self)
        self.explorer.queue.forget(self)
        self.explorer.board_queue.forget(self)

    def send(self, message: Message) -> None:
        """Send a message, from any thread."""
        self._loop.add_callback(self._write, text_of(message))

    def _write(self, text: str) -> None:
        with contextlib.suppress(WebSocketClosedError):
            self.write_message(text)
