"""`palpate live --page` and `palpate view`: in a real browser, and before other sites. What one client can
take of the page's server is tested in tests/cli/page_test.cpp."""

import gzip
import http.client
import json
import os
import pathlib
import re
import socket
import subprocess
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from conftest import Maps, command, run
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select, WebDriverWait

import palpate

#: Four touches of an E, at ten times the speed of a robot; what was touched is known.
STREAM = "simulate:E,seed=8,touches=4,speed=10,object=random"
FAST = STREAM.replace("=10", "=max")
BINS = ("--maps", "maps", "--bins", "20x20x24")


class Paged:
    """A command with a page."""

    def __init__(self, folder: pathlib.Path, *arguments: str):
        self.process = subprocess.Popen(
            [os.environ["PALPATE_COMMAND"], *arguments], cwd=folder, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        assert self.process.stdout is not None
        first = self.process.stdout.readline()
        match = re.fullmatch(r"the page is at (http://127\.0\.0\.1:(\d+)/).*\n", first)
        assert match, first + self.process.stdout.read()
        self.url, self.port = match[1], int(match[2])

    def end(self) -> str:
        """Ends the command as `kill` does, and returns what it has said."""
        self.process.terminate()
        said, _ = self.process.communicate(timeout=60)
        assert self.process.returncode == 0, said
        return said


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, maps: Maps) -> pathlib.Path:
    """A folder with maps of A, E and I."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "maps").mkdir()
    for one in maps:
        one.save(folder / "maps" / f"{one.label}.map.h5")
    return folder


@pytest.fixture(scope="module")
def paged(folder: pathlib.Path) -> Iterator[Callable[..., Paged]]:
    """Starts commands, which end with the tests."""
    started: list[Paged] = []

    def start(*arguments: str) -> Paged:
        started.append(Paged(folder, *arguments))
        return started[-1]

    yield start
    for one in started:
        one.process.kill()
        one.process.wait()


@pytest.fixture(scope="module")
def live(paged: Callable[..., Paged]) -> Callable[..., Paged]:
    """Starts `palpate live`, with a page at a free port or at `port`."""

    def start(*options: str, port: int = 0, sensor: str = STREAM) -> Paged:
        return paged("live", "--sensor", sensor, *BINS, *options, "--page", str(port))

    return start


# In a browser.


class Browser(webdriver.Chrome):
    """Debian's Chromium without a screen."""

    def __init__(self) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        # With the driver named, Selenium looks for none on the network.
        super().__init__(options, webdriver.ChromeService(executable_path="/usr/bin/chromedriver"))
        self.set_window_size(1280, 1000)

    def text(self, name: str) -> str:
        return str(self.find_element(By.ID, name).text)

    def until(self, condition: Callable[[], bool]) -> None:
        WebDriverWait(self, 30, poll_frequency=0.05).until(lambda _: condition())

    def touches(self) -> int:
        return len(self.find_elements(By.CSS_SELECTOR, "#touches li"))

    def picture(self, canvas: str) -> str:
        """The canvas as it is drawn."""
        script = f"return document.getElementById('{canvas}').toDataURL()"
        return str(self.execute_script(script))

    def visit(self, command: Paged, last: int = 4) -> None:
        """Opens the command's page, and waits for its last touch."""
        self.get("about:blank")  # the page before would complain that its server is gone
        self.complaints()
        self.get(command.url)
        self.until(lambda: self.touches() == last)

    def complaints(self) -> list[str]:
        return [entry["message"] for entry in self.get_log("browser")]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    driver = Browser()
    yield driver
    driver.quit()


def test_the_page_shows_the_right_object(browser: Browser, live: Callable[..., Paged]) -> None:
    command = live("--plan", "both", "--filter", "histogram", "--act-below-mm", "5")
    browser.visit(command)
    browser.until(lambda: "touch next at" in browser.text("words"))
    assert re.fullmatch(r"E \d+ %", browser.title)
    assert browser.text("decision") == "Act"
    for name, words in (
        ("because", "95 % of the belief lies within"), ("headline", "E ("), ("words", "truth: E at x"),
        ("numbers", "fits"), ("identities", "A"), ("identities", "I"),
    ):  # fmt: skip
        assert words in browser.text(name)
    blank = browser.execute_script(
        "const c = document.createElement('canvas'); const r = document.getElementById('robot');"
        "c.width = r.width; c.height = r.height; return c.toDataURL()"
    )
    pictures = {name: browser.picture(name) for name in ("robot", "belief", "array", "turn")}
    assert blank not in pictures.values() and len(set(pictures.values())) == 4
    assert browser.complaints() == []
    if screenshots := os.environ.get("PALPATE_SCREENSHOTS"):
        browser.save_screenshot(str(pathlib.Path(screenshots) / "live_page.png"))
    # Another client sees the same.
    title = browser.title
    browser.switch_to.new_window("tab")
    browser.get(command.url)
    browser.until(lambda: browser.touches() == 4)
    browser.until(lambda: browser.title == title)
    browser.close()
    browser.switch_to.window(browser.window_handles[0])
    assert "4 touches" in command.end()


def test_buttons_do_what_they_say_and_a_page_comes_back_after_a_break(
    browser: Browser, live: Callable[..., Paged], tmp_path: pathlib.Path
) -> None:
    command = live("--json", str(tmp_path / "live.jsonl"))
    browser.visit(command)

    def left_out() -> bool:
        return bool(browser.find_elements(By.CSS_SELECTOR, "#touches li.out"))

    def toggle_second() -> list[dict[str, Any]]:
        """Leaves the second touch out, or takes it in; returns the records so far."""
        before = left_out()
        browser.find_element(By.CSS_SELECTOR, "#touches li:nth-child(2) button").click()
        browser.until(lambda: left_out() != before)
        return [json.loads(line) for line in (tmp_path / "live.jsonl").read_text().splitlines()]

    # A touch that is left out leaves the belief of the three others.
    records = toggle_second()
    assert [record.get("left_out") for record in records] == 4 * [None] + [[1]]
    assert records[4]["mode"]["log_likelihood"] > records[3]["mode"]["log_likelihood"]
    records = toggle_second()
    for key in ("identity", "mode", "refined"):
        assert records[5][key] == records[3][key]

    # The belief of another object.
    before = browser.picture("belief")
    Select(browser.find_element(By.ID, "object")).select_by_visible_text("A")
    browser.until(lambda: browser.picture("belief") != before)

    # Zoom with the keyboard, and back.
    before = browser.picture("robot")
    browser.find_element(By.ID, "robot").send_keys("+")
    browser.until(lambda: browser.picture("robot") != before)
    browser.find_element(By.ID, "fit-views").click()
    browser.until(lambda: browser.picture("robot") == before)

    # Keys are the page's own, but not with Ctrl or Meta, nor where somebody types or chooses.
    def paused_by(selector: str, **modifiers: bool) -> bool:
        browser.execute_script(
            "const [selector, modifiers] = arguments;"
            "document.querySelector(selector).dispatchEvent("
            "new KeyboardEvent('keydown', {key: 'p', bubbles: true, ...modifiers}))", selector, modifiers,
        )  # fmt: skip
        return browser.find_element(By.ID, "pause").get_attribute("aria-pressed") == "true"

    assert not paused_by("body", ctrlKey=True) and not paused_by("body", metaKey=True)
    assert not paused_by("#object") and not paused_by("#filter")
    assert paused_by("body") and not paused_by("body")

    browser.find_element(By.ID, "next-unknown").click()
    browser.until(lambda: browser.touches() == 0 and browser.title == "Palpate")
    assert browser.text("decision") == "waiting for the first touch"
    assert browser.complaints() == []

    command.end()
    browser.until(lambda: "lost" in browser.text("connection"))
    live(port=command.port, sensor="simulate:A,seed=3,touches=3,speed=10,object=random")
    browser.until(lambda: browser.title.startswith("A ") and browser.touches() == 3)
    assert browser.text("connection") == "connected"
    browser.complaints()  # of the break


def test_saved_files_are_shown(
    browser: Browser, paged: Callable[..., Paged], folder: pathlib.Path, unknown: palpate.Recording
) -> None:
    unknown.save(folder / "unknown.h5")
    command("recognize", "unknown.h5", *BINS, "--json", "records.json", "--trace", cwd=folder)
    command("live", "--sensor", FAST, *BINS, "--json", "live.jsonl", cwd=folder)
    command("record", "--sensor", FAST, "-o", "frames.h5", cwd=folder)
    command("batch", *3 * ["unknown.h5"], *BINS, "-o", "batch", cwd=folder)
    files = ["records.json", "live.jsonl", "frames.h5", "maps/A.map.h5", "unknown.h5", "batch"]
    browser.visit(paged("view", *files, "--page", "0"), 9)
    choice = Select(browser.find_element(By.ID, "file"))
    assert len(choice.options) == 6
    assert browser.title.startswith("E ") and "E (" in browser.text("headline")
    blank = browser.picture("robot")

    def shows(words: str, name: str = "scrub") -> None:
        browser.until(lambda: words in browser.text(name))

    def drag(*rows: int) -> None:
        browser.execute_script(
            "const r = document.getElementById('row');"
            "for (const to of arguments) { r.value = to; r.oninput(); }", *rows,
        )  # fmt: skip

    drag(2)
    shows("touch 3 of 9")
    assert browser.touches() == 3

    choice.select_by_index(1)
    shows("unknown 1", "records")
    browser.until(lambda: browser.touches() == 4)
    assert "truth: E; error" in browser.text("words")

    choice.select_by_index(2)
    shows("frame 1 of")
    untouched = browser.picture("array")
    drag(150)
    shows("frame 151 of")
    browser.until(lambda: browser.picture("array") != untouched)
    # Whoever drags ends where the slider is, whatever the order of the answers.
    drag(300, 0, 400, 120)
    shows("frame 121 of")

    choice.select_by_index(3)
    browser.until(lambda: browser.title == "maps/A.map.h5")
    browser.until(lambda: browser.picture("robot") != blank)

    choice.select_by_index(4)
    shows("touch 1 of 9")

    choice.select_by_index(5)
    shows("3 of 3 records", "records")
    browser.find_element(By.ID, "filter").send_keys("nothing such")
    shows("0 of 3 records", "records")
    assert browser.complaints() == []


# Before other sites.


@pytest.fixture(scope="module")
def served(live: Callable[..., Paged]) -> Paged:
    return live()


def request(port: int, method: str, path: str, body: "str | bytes" = b"", **headers: str) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    content = body.encode() if isinstance(body, str) else body
    connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
    for name, value in {**headers, "Content-Length": str(len(content))}.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders(content)
    answer = connection.getresponse()
    said = answer.read()
    connection.close()
    return answer.status, said


NEXT = '{"do": "next unknown"}'


def test_other_sites_and_bad_requests_are_refused(served: Paged) -> None:
    port = served.port
    for host in ("evil.example", f"evil.example:{port}", "", "localhost.evil.example"):
        assert request(port, "GET", "/events", Host=host)[0] == 403, host
        assert request(port, "POST", "/do", NEXT, Host=host)[0] == 403
    for origin in ("http://evil.example", "null", f"https://127.0.0.1:{port}"):
        assert request(port, "GET", "/events", Origin=origin)[0] == 403, origin
    own = f"localhost:{port}"
    assert request(port, "GET", "/", Host=own, Origin="http://" + own)[0] == 200
    for path in ("/page.cpp", "/../page.js", "//etc/passwd", "/map/9", "/map/-1", "/events/x"):
        assert request(port, "GET", path)[0] == 404, path
    objects = ("99", "3", "-2", "0.5", "4294967296", "1e+300")
    touches = ("-1", "4", "0.5", "18446744073709551615", "1e+300")
    for body, words in (
        ("", "object of JSON"),
        ("[1]", "object of JSON"),
        ("{}", "names what it asks for"),
        ('{"do": "look at"}', "names what it asks for"),
        *((f'{{"do": "look at", "object": {i}}}', f"object {i}: there is none") for i in objects),
        *((f'{{"do": "leave out", "touch": {i}}}', f"touch {i}: there is none") for i in touches),
        ('{"do": "leave out", "touch": "x"}', "names what it asks for"),
        ('{"do": "format the disk"}', "is not one of the page's requests"),
    ):
        status, said = request(port, "POST", "/do", body)
        assert status in (400, 409) and words.encode() in said, (body, said)
    assert request(port, "POST", "/do", '{"do": "' + 5000 * "x" + '"}')[0] == 413
    assert request(port, "POST", "/do", gzip.compress(NEXT.encode()), Content_Encoding="gzip")[0] == 400
    assert request(port, "POST", "/do", NEXT)[0] == 200


def test_pages_are_capped(served: Paged) -> None:
    looking = []
    for _ in range(16):
        connection = socket.create_connection(("127.0.0.1", served.port), timeout=20)
        connection.sendall(f"GET /events HTTP/1.1\r\nHost: localhost:{served.port}\r\n\r\n".encode())
        assert b" 200 " in connection.recv(4096)
        looking.append(connection)
    status, said = request(served.port, "GET", "/events")
    assert status == 503 and b"16 pages look already" in said
    assert request(served.port, "GET", "/")[0] == 200
    for connection in looking:
        connection.close()


def test_an_address_that_cannot_be_had_is_refused(served: Paged, folder: pathlib.Path) -> None:
    for flags, words in (
        (["--page", served.port], f"--page {served.port}: cannot be had at 127.0.0.1: another program may use it"),
        (["--page-address", "0.0.0.0"], "--page-address requires --page"),
    ):
        done = run("live", "--sensor", STREAM, "--maps", "maps", *flags, cwd=folder)
        assert (done.returncode, done.stdout) == (2, "") and words in done.stderr
