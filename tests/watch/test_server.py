"""The server answers the page of its folder to its own browser, and nothing to all others."""

import http.client
import socket
import threading
import time
from http import HTTPStatus

import pytest

from tisim import InputError
from tisim.watch.server import HEADERS, LOOPBACK, REQUEST_TIMEOUT, Reply, WatchServer

SECRET = b"the page"


@pytest.fixture
def asked():
    """The queries of all answered requests."""
    return []


@pytest.fixture
def server(asked):
    def page(query):
        asked.append(query)
        return Reply(SECRET, "text/html")

    with WatchServer({"": page, "news": page}) as running:
        yield running


def request(server, path=None, method="GET", host=None, **headers):
    """The status, headers and content of an answer. Names of headers have "_" in place of "-"."""
    connection = http.client.HTTPConnection(LOOPBACK, server.server_port, timeout=5)
    connection.putrequest(method, f"/{server.token}/" if path is None else path, skip_host=True)
    if host != "":
        connection.putheader("Host", host or server.hosts[0])
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), content


def test_its_own_browser_gets_the_page(server, asked):
    status, headers, content = request(server)
    assert (status, content) == (HTTPStatus.OK, SECRET)
    assert headers.items() >= HEADERS.items()
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    assert request(server, f"/{server.token}/news?after=3&key=a")[0] == HTTPStatus.OK
    assert asked == [{}, {"after": "3", "key": "a"}]


def test_a_fault_of_a_page_is_an_answer_and_is_reported(capfd):
    """A browser that closes its connection is no fault."""

    def page(query):
        raise {"a": KeyError("lost"), "b": ConnectionResetError("gone")}[query["of"]]

    with WatchServer({"": page}) as running:
        for of in "ab":
            status, _, content = request(running, f"/{running.token}/?of={of}")
            assert status == HTTPStatus.INTERNAL_SERVER_ERROR
            assert b"lost" not in content
    told = capfd.readouterr().err
    assert "KeyError: 'lost'" in told
    assert "ConnectionResetError: gone" not in told
    assert running.token not in told


def test_it_listens_on_the_loopback_alone(server):
    assert server.socket.getsockname() == (LOOPBACK, server.server_port)
    assert server.address == f"http://127.0.0.1:{server.server_port}/{server.token}/"


@pytest.mark.parametrize("host", ["127.0.0.1:{}", "localhost:{}", "LOCALHOST:{}"])
def test_its_own_names_are_accepted(server, host):
    assert request(server, host=host.format(server.server_port))[0] == HTTPStatus.OK


@pytest.mark.parametrize(
    "host",
    [
        "evil.example:{}",
        "evil.example",
        "127.0.0.1",
        "127.0.0.1:1",
        "",
        "127.0.0.1:{}.evil.example",
        "[::1]:{}",
    ],
)
def test_another_host_is_refused(server, asked, host):
    """A name of another site may lead to 127.0.0.1 (DNS rebinding)."""
    status, headers, content = request(server, host=host.format(server.server_port))
    assert status == HTTPStatus.FORBIDDEN
    assert SECRET not in content
    assert headers.items() >= HEADERS.items()
    assert asked == []


def test_two_hosts_are_refused(server, asked):
    assert request(server, HOST="evil.example")[0] == HTTPStatus.FORBIDDEN
    assert asked == []


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:{}", "http://127.0.0.1:1", "file://"]
)
def test_another_origin_is_refused(server, asked, origin):
    status, _, content = request(server, Origin=origin.format(server.server_port))
    assert (status, SECRET in content, asked) == (HTTPStatus.FORBIDDEN, False, [])


def test_its_own_origin_is_accepted(server):
    assert request(server, Origin=f"http://{server.hosts[0]}")[0] == HTTPStatus.OK


def test_a_request_that_another_site_begins_is_refused_unless_it_is_a_link(server, asked):
    for site in ("cross-site", "same-site"):
        assert request(server, Sec_Fetch_Site=site, Sec_Fetch_Mode="no-cors")[0] == HTTPStatus.FORBIDDEN
    assert asked == []
    assert request(server, Sec_Fetch_Site="same-origin", Sec_Fetch_Mode="cors")[0] == HTTPStatus.OK
    assert request(server, Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="navigate")[0] == HTTPStatus.OK


def test_a_wrong_token_is_refused(server, asked):
    token = server.token
    for wrong in (
        "",
        "a",
        token[:-1],
        token + "a",
        token.swapcase(),
        "%",
        "x" * 60000,
    ):
        for path in (f"/{wrong}/", f"/{wrong}/news", f"/{wrong}"):
            status, _, content = request(server, path)
            assert status in (HTTPStatus.NOT_FOUND, HTTPStatus.REQUEST_URI_TOO_LONG), path
            assert SECRET not in content
    assert asked == []


def test_tokens_are_long_and_new():
    servers = [WatchServer({}) for _ in range(3)]
    tokens = {server.token for server in servers}
    for server in servers:
        server.server_close()
    assert len(tokens) == 3
    assert min(map(len, tokens)) >= 32


@pytest.mark.parametrize(
    "path",
    [
        "", "/", "/{}",
        "/{}//", "/{}/x", "/{}/news/", "/{}/../{}/", "/./{}/", "/{}/..", "/{}/../../etc/passwd",
        "/{}/%2e%2e/etc/passwd", "/{}/..%2f..%2fetc%2fpasswd", "/{}/trajectory.h5", "/{}/news%00", "*",
        "/{}/%6eews", "/../{}/", "http://evil.example/{}/", "http://127.0.0.1/{}/", "//evil.example/{}/",
        "http://[/{}/", "{}/", "/{}/;news", "/{}/news;x", "/{}#/", "/{}?/",
    ],
)  # fmt: skip
def test_other_paths_are_refused(server, asked, path):
    status, _, content = request(server, path.replace("{}", server.token) or "/")
    assert status in (HTTPStatus.NOT_FOUND, HTTPStatus.BAD_REQUEST)
    assert b"root:" not in content
    assert asked == []


@pytest.mark.parametrize(
    "method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "HEAD", "TRACE", "CONNECT", "get", "X" * 50]
)
def test_only_get_is_answered(server, asked, method):
    status, _, content = request(server, method=method)
    assert status == HTTPStatus.NOT_IMPLEMENTED
    assert (SECRET in content, asked) == (False, [])


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"\r\n\r\n",
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"\xff\xfe\x00" * 100,
        b"GET " + b"a" * 70000 + b"\r\n",
    ],
)
def test_what_is_no_request_gets_nothing(server, asked, line):
    with socket.create_connection((LOOPBACK, server.server_port), timeout=5) as connection:
        connection.sendall(line)
        connection.shutdown(socket.SHUT_WR)
        content = b""
        while piece := connection.recv(4096):
            content += piece
    assert SECRET not in content
    assert asked == []
    assert request(server)[0] == HTTPStatus.OK, "it goes on"


def test_a_browser_that_goes_away_does_no_harm(capfd):
    began, go_on = threading.Event(), threading.Event()

    def slow(query):
        began.set()
        go_on.wait(5)
        return Reply(bytes(10_000_000), "text/html")

    with WatchServer({"": slow}) as server:
        with socket.create_connection((LOOPBACK, server.server_port)) as connection:
            connection.sendall(f"GET /{server.token}/ HTTP/1.1\r\nHost: {server.hosts[0]}\r\n\r\n".encode())
            assert began.wait(5)
        go_on.set()
        assert len(request(server)[2]) == 10_000_000
    assert capfd.readouterr() == ("", ""), "nothing is printed, because addresses have the token"


def test_a_port_that_is_taken_or_none_is_refused(server):
    with pytest.raises(InputError, match=rf"port must be one that is free; received {server.server_port}"):
        WatchServer({}, server.server_port)
    with pytest.raises(InputError, match="port must be 0 to 65535; received 70000"):
        WatchServer({}, 70000)


def test_it_ends_at_once_beside_idle_connections_and_after_answers():
    began, go_on, replies = threading.Event(), threading.Event(), []

    def slow(query):
        began.set()
        go_on.wait(5)
        return Reply(SECRET, "text/html")

    server = WatchServer({"": slow})
    with server:
        idle = socket.create_connection((LOOPBACK, server.server_port))
        asking = threading.Thread(target=lambda: replies.append(request(server)))
        asking.start()
        assert began.wait(5)
        threading.Timer(0.2, go_on.set).start()
        before = time.monotonic()
    assert time.monotonic() - before < REQUEST_TIMEOUT / 2
    asking.join()
    idle.close()
    assert replies[0][2] == SECRET
    assert [one for one in threading.enumerate() if "process_request" in one.name] == []


def test_after_its_end_nothing_answers():
    with WatchServer({}) as server:
        port = server.server_port
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((LOOPBACK, port), timeout=5)
