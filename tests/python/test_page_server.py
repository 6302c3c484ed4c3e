"""`palpate live --page` before other sites, hostile clients and bad flags."""

import gzip
import http.client
import os
import pathlib
import random
import re
import socket
import subprocess
from collections.abc import Callable

from paged import STREAM, Paged, folder, live, paged

__all__ = ["folder", "live", "paged"]  # fixtures


def request(port: int, method: str, path: str, **headers: str) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
    body = headers.pop("body", "").encode()
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.putheader("Content-Length", str(len(body)))
    connection.endheaders(body)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, content


def test_other_sites_and_bad_requests_are_refused(live: Callable[..., Paged]) -> None:
    port = live().port
    for host in ("evil.example", f"evil.example:{port}", "", "localhost.evil.example"):
        assert request(port, "GET", "/events", Host=host)[0] == 403, host
        assert request(port, "POST", "/do", Host=host, body='{"do": "next unknown"}')[0] == 403
    for origin in ("http://evil.example", "null", f"https://127.0.0.1:{port}"):
        assert request(port, "GET", "/events", Origin=origin)[0] == 403, origin
    own = f"localhost:{port}"
    assert request(port, "GET", "/", Host=own, Origin="http://" + own)[0] == 200
    for path in ("/page.cpp", "/../page.js", "//etc/passwd", "/map/9", "/map/-1", "/events/x"):
        assert request(port, "GET", path)[0] == 404, path
    for body, words in (
        ("", b"object of JSON"),
        ("[1]", b"object of JSON"),
        ("{}", b"names what it asks for"),
        ('{"do": "look at"}', b"names what it asks for"),
        *(
            (f'{{"do": "look at", "object": {i}}}', f"object {i}: there is none".encode())
            for i in ("99", "3", "-2", "0.5", "4294967296", "1e+300")
        ),
        *(
            (f'{{"do": "leave out", "touch": {i}}}', f"touch {i}: there is none".encode())
            for i in ("-1", "4", "0.5", "18446744073709551615", "1e+300")
        ),
        ('{"do": "leave out", "touch": "x"}', b"names what it asks for"),
        ('{"do": "format the disk"}', b"is not one of the page's requests"),
    ):
        status, said = request(port, "POST", "/do", body=body)
        assert status in (400, 409) and words in said, (body, said)
    assert request(port, "POST", "/do", body='{"do": "' + 5000 * "x" + '"}')[0] == 413
    assert request(port, "POST", "/do", body='{"do": "next unknown"}')[0] == 200


def test_a_compressed_body_is_not_taken(live: Callable[..., Paged]) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", live().port, timeout=20)
    body = gzip.compress(b'{"do": "next unknown"}')
    connection.request("POST", "/do", body, {"Content-Encoding": "gzip"})
    assert connection.getresponse().status == 400


def hostile(port: int, requests: int, seed: int) -> None:
    """Sends so many requests of random bytes, and reads what comes back."""
    generator = random.Random(seed)
    methods = ["GET", "POST", "PUT", "HEAD", "OPTIONS", "DELETE", "TRACE", "G\0T", "", 300 * "M"]
    paths = ["/", "/events", "/do", "/map/0", "/%2e%2e/", "/%", "/" + 9000 * "a", "*", "http://x/"]
    names = ["Range", "Content-Length", "Transfer-Encoding", "Content-Encoding", "Host", "Expect"]
    values = ["bytes=0-1,2-3,-", "-1", "chunked", "gzip", "99999999999999999999", 9000 * "v", ""]
    for _ in range(requests):
        path = generator.choice([*paths, "/" + generator.randbytes(20).decode("latin-1")])
        head = f"{generator.choice(methods)} {path} HTTP/1.{generator.randrange(3)}\r\n"
        if generator.random() < 0.9:
            head += f"Host: 127.0.0.1:{port}\r\n"
        for _ in range(generator.randrange(4)):
            head += f"{generator.choice(names)}: {generator.choice(values)}\r\n"
        body = generator.randbytes(generator.randrange(100))
        with socket.create_connection(("127.0.0.1", port), timeout=20) as connection:
            try:
                connection.sendall(head.encode("latin-1") + b"\r\n" + body)
                connection.shutdown(socket.SHUT_WR)
                connection.recv(4096)
            except TimeoutError:
                raise
            except OSError:
                pass  # hung up on, and rightly


def memory_mib(pid: int) -> float:
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    match = re.search(r"VmRSS:\s+(\d+) kB", status)
    assert match
    return int(match[1]) / 1024


def test_hostile_requests_do_no_harm(live: Callable[..., Paged]) -> None:
    # More by hand: PALPATE_HOSTILE=100000.
    requests = int(os.environ.get("PALPATE_HOSTILE", "1000"))
    command = live()
    hostile(command.port, 300, seed=1)
    before = memory_mib(command.process.pid)
    hostile(command.port, requests, seed=2)
    assert memory_mib(command.process.pid) < before + 30
    status, page = request(command.port, "GET", "/")
    assert status == 200 and b"<title>Palpate</title>" in page
    assert " frames, 0 lost" in command.end()


def test_pages_are_capped(live: Callable[..., Paged]) -> None:
    port = live().port
    looking = []
    for _ in range(16):
        connection = socket.create_connection(("127.0.0.1", port), timeout=20)
        connection.sendall(f"GET /events HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n".encode())
        assert b" 200 " in connection.recv(4096)
        looking.append(connection)
    status, said = request(port, "GET", "/events")
    assert status == 503 and b"16 pages look already" in said
    assert request(port, "GET", "/")[0] == 200
    for connection in looking:
        connection.close()


def test_a_port_in_use_is_refused(live: Callable[..., Paged], folder: pathlib.Path) -> None:
    port = live().port
    arguments = ["live", "--sensor", STREAM, "--maps", str(folder / "maps"), "--page", str(port)]
    run = subprocess.run(
        [os.environ["PALPATE_COMMAND"], *arguments], capture_output=True, text=True, timeout=60
    )
    assert run.returncode == 2 and run.stdout == ""
    assert f"--page {port}: cannot be had at 127.0.0.1: another program may use it" in run.stderr


def test_an_address_without_a_page_is_refused(folder: pathlib.Path) -> None:
    arguments = ["live", "--sensor", STREAM, "--maps", str(folder / "maps")]
    run = subprocess.run(
        [os.environ["PALPATE_COMMAND"], *arguments, "--page-address", "0.0.0.0"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert run.returncode == 2 and "--page-address requires --page" in run.stderr
