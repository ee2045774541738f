"""A server of the pages of one folder, for the browser of the same user on the same machine.

It binds to the loopback interface. Other users and programs of the machine can connect to it too, and a
browser sends requests on behalf of any page that it shows. Therefore a request is answered only if

- its path begins with a token, which is random and known from standard output alone;
- its Host is the address of the server, so that a name of another site that leads to 127.0.0.1 does not help;
- it has no Origin of another site, and no other site has begun it, except by a link.

No path leads to a file: the answers are those of a ``Watched``, by their names.
"""

from __future__ import annotations

import contextlib
import http.server
import secrets
import socket
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qsl

from tisim.errors import InputError, must

LOOPBACK = "127.0.0.1"
TOKEN_BYTES = 24
"""Number of random bytes of a token."""
REQUEST_TIMEOUT = 10.0
"""Time after which a connection that sends nothing is closed, s."""
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""Headers of every answer: it is not stored or shown within other pages, and its address is not passed on."""


@dataclass(frozen=True)
class Reply:
    """An answer: its content, and the kind of it, such as "text/html"."""

    content: bytes
    kind: str


Replies = Mapping[str, Callable[[Mapping[str, str]], Reply]]
"""Functions of the query that answer requests, by the last part of the path; "" for the page itself."""


class WatchServer(http.server.ThreadingHTTPServer):
    """A server on the loopback interface. It is a context manager: within it, requests are answered."""

    # A thread that is ended within HDF5 at the exit of Python would abort the process.
    daemon_threads = False

    def __init__(self, answers: Replies, port: int = 0) -> None:
        """port : 0 for one that is free.

        Raise InputError if the port cannot be used.
        """
        must(0 <= port < 2**16, "port", "0 to 65535", port)
        self.answers, self.token = answers, secrets.token_urlsafe(TOKEN_BYTES)
        self._connections = set[socket.socket]()
        try:
            super().__init__((LOOPBACK, port), _Handler)
        except OSError as error:
            raise InputError(f"port must be one that is free; received {port} ({error.strerror})") from None
        self._thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.2}, daemon=True)

    @property
    def hosts(self) -> tuple[str, str]:
        """Return the names of the server, with its port, that a request may use."""
        return f"{LOOPBACK}:{self.server_port}", f"localhost:{self.server_port}"

    @property
    def address(self) -> str:
        """Return the address of the page, which has the token."""
        return f"http://{self.hosts[0]}/{self.token}/"

    def __enter__(self) -> WatchServer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        self._thread.join()
        # Browsers keep connections open without a request.
        for connection in list(self._connections):
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RD)
        self.server_close()  # waits until answers are complete

    def process_request(self, request: Any, client_address: Any) -> None:
        self._connections.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        super().shutdown_request(request)
        self._connections.discard(request)

    def server_bind(self) -> None:
        # The standard library asks a name server for the name of the machine here, which may take seconds.
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = LOOPBACK, self.server_address[1]

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore a browser that has closed its connection; report any other error on standard error."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(http.server.BaseHTTPRequestHandler):
    server: WatchServer
    timeout = REQUEST_TIMEOUT
    server_version, sys_version = "tisim", ""

    def do_GET(self) -> None:
        refusal = self._refusal()
        try:
            answer = None if refusal else self._answer()
        except Exception:
            self.send_error(HTTPStatus.INTERNAL_SERVER_ERROR)
            raise
        if answer is None:
            self.send_error(refusal or HTTPStatus.NOT_FOUND)
            return
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{answer.kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(answer.content)))
        self.end_headers()
        self.wfile.write(answer.content)

    def _refusal(self) -> HTTPStatus | None:
        """Return the status of a request that another site may have begun, or None."""
        hosts, headers = self.server.hosts, self.headers
        names = headers.get_all("Host") or []
        if len(names) != 1 or names[0].lower() not in hosts:
            return HTTPStatus.FORBIDDEN
        origins = {f"http://{host}" for host in hosts}
        if any(origin not in origins for origin in headers.get_all("Origin") or []):
            return HTTPStatus.FORBIDDEN
        by_another = headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin")
        if by_another and headers.get("Sec-Fetch-Mode") != "navigate":
            return HTTPStatus.FORBIDDEN
        return None

    def _answer(self) -> Reply | None:
        """Return the answer, or None if the token is wrong or there is no such name."""
        # Exactly "/token/name": nothing is decoded or resolved, so that no path leads elsewhere.
        path, _, query = self.path.partition("?")
        first, *parts = path.split("/")
        if first or len(parts) != 2:
            return None
        token, name = parts
        if not secrets.compare_digest(token.encode(), self.server.token.encode()):
            return None
        answer = self.server.answers.get(name)
        return None if answer is None else answer(dict(parse_qsl(query)))

    def end_headers(self) -> None:
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.send_header("Connection", "close")
        super().end_headers()

    def log_message(self, format: str, *arguments: Any) -> None:
        """Print nothing: the addresses have the token."""
