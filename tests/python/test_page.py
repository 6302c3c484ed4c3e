"""`palpate live --page` and `palpate view` in a real browser."""

import json
import os
import pathlib
import re
import subprocess
import urllib.request
from collections.abc import Callable, Iterator

import pytest
from paged import STREAM, Paged, folder, live, paged
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select, WebDriverWait

import palpate

__all__ = ["folder", "live", "paged"]  # fixtures


@pytest.fixture(scope="module")
def browser() -> Iterator[webdriver.Chrome]:
    """Debian's Chromium without a screen."""
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    # With the driver named, Selenium looks for none on the network.
    service = webdriver.ChromeService(executable_path="/usr/bin/chromedriver")
    driver = webdriver.Chrome(options=options, service=service)
    driver.set_window_size(1280, 1000)
    yield driver
    driver.quit()


def text(browser: webdriver.Chrome, name: str) -> str:
    return str(browser.find_element(By.ID, name).text)


def wait(browser: webdriver.Chrome, condition: Callable[[], bool]) -> None:
    WebDriverWait(browser, 30, poll_frequency=0.05).until(lambda _: condition())


def touches(browser: webdriver.Chrome) -> int:
    return len(browser.find_elements(By.CSS_SELECTOR, "#touches li"))


def picture(browser: webdriver.Chrome, canvas: str) -> str:
    """The canvas as it is drawn."""
    script = f"return document.getElementById('{canvas}').toDataURL()"
    return str(browser.execute_script(script))


def visit(browser: webdriver.Chrome, command: Paged, last: int = 4) -> None:
    """Opens the command's page, and waits for its last touch."""
    browser.get("about:blank")  # the page before would complain that its server is gone
    complaints(browser)
    browser.get(command.url)
    wait(browser, lambda: touches(browser) == last)


def complaints(browser: webdriver.Chrome) -> list[str]:
    return [entry["message"] for entry in browser.get_log("browser")]


def test_the_page_shows_the_right_object(
    browser: webdriver.Chrome, live: Callable[..., Paged]
) -> None:
    command = live("--plan", "both", "--filter", "histogram", "--act-below-mm", "5")
    visit(browser, command)
    wait(browser, lambda: "touch next at" in text(browser, "words"))
    assert re.fullmatch(r"E \d+ %", browser.title)
    assert text(browser, "decision") == "Act"
    assert "95 % of the belief lies within" in text(browser, "because")
    assert "E (" in text(browser, "headline")
    assert "truth: E at x" in text(browser, "words")
    assert "fits" in text(browser, "numbers")
    assert "A" in text(browser, "identities") and "I" in text(browser, "identities")
    blank = browser.execute_script(
        "const c = document.createElement('canvas'); const r = document.getElementById('robot');"
        "c.width = r.width; c.height = r.height; return c.toDataURL()"
    )
    pictures = {name: picture(browser, name) for name in ("robot", "belief", "array", "turn")}
    assert blank not in pictures.values() and len(set(pictures.values())) == 4
    assert complaints(browser) == []
    if folder := os.environ.get("PALPATE_SCREENSHOTS"):
        browser.save_screenshot(str(pathlib.Path(folder) / "live_page.png"))
    # Another client sees the same.
    title = browser.title
    browser.switch_to.new_window("tab")
    browser.get(command.url)
    wait(browser, lambda: touches(browser) == 4)
    wait(browser, lambda: browser.title == title)
    browser.close()
    browser.switch_to.window(browser.window_handles[0])
    assert "4 touches" in command.end()


def test_buttons_do_what_they_say(
    browser: webdriver.Chrome, live: Callable[..., Paged], tmp_path: pathlib.Path
) -> None:
    command = live("--json", str(tmp_path / "live.jsonl"))
    visit(browser, command)

    # A touch that is left out leaves the belief of the three others.
    browser.find_element(By.CSS_SELECTOR, "#touches li:nth-child(2) button").click()
    wait(browser, lambda: bool(browser.find_elements(By.CSS_SELECTOR, "#touches li.out")))
    records = [json.loads(line) for line in (tmp_path / "live.jsonl").read_text().splitlines()]
    assert [record.get("left_out") for record in records] == 4 * [None] + [[1]]
    assert records[4]["mode"]["log_likelihood"] > records[3]["mode"]["log_likelihood"]
    browser.find_element(By.CSS_SELECTOR, "#touches li:nth-child(2) button").click()
    wait(browser, lambda: not browser.find_elements(By.CSS_SELECTOR, "#touches li.out"))
    records = [json.loads(line) for line in (tmp_path / "live.jsonl").read_text().splitlines()]
    for key in ("identity", "mode", "refined"):
        assert records[5][key] == records[3][key]

    # The belief of another object.
    before = picture(browser, "belief")
    Select(browser.find_element(By.ID, "object")).select_by_visible_text("A")
    wait(browser, lambda: picture(browser, "belief") != before)

    # Zoom with the keyboard, and back.
    before = picture(browser, "robot")
    browser.find_element(By.ID, "robot").send_keys("+")
    wait(browser, lambda: picture(browser, "robot") != before)
    browser.find_element(By.ID, "fit-views").click()
    wait(browser, lambda: picture(browser, "robot") == before)

    browser.find_element(By.ID, "next-unknown").click()
    wait(browser, lambda: touches(browser) == 0 and browser.title == "Palpate")
    assert text(browser, "decision") == "waiting for the first touch"
    assert complaints(browser) == []


def test_a_page_comes_back_after_a_break(
    browser: webdriver.Chrome, live: Callable[..., Paged]
) -> None:
    command = live()
    visit(browser, command)
    command.end()
    wait(browser, lambda: "lost" in text(browser, "connection"))
    live(port=command.port, sensor="simulate:A,seed=3,touches=3,speed=10,object=random")
    wait(browser, lambda: browser.title.startswith("A ") and touches(browser) == 3)
    assert text(browser, "connection") == "connected"
    complaints(browser)  # of the break


def test_saved_files_are_shown(
    browser: webdriver.Chrome,
    paged: Callable[..., Paged],
    folder: pathlib.Path,
    unknown: palpate.Recording,
) -> None:
    unknown.save(folder / "unknown.h5")
    arguments = ["--maps", "maps", "--bins", "20x20x24", "--json"]
    run(folder, "recognize", "unknown.h5", *arguments, "records.json", "--trace")
    run(folder, "live", "--sensor", STREAM.replace("=10", "=max"), *arguments, "live.jsonl")
    run(folder, "record", "--sensor", STREAM.replace("=10", "=max"), "-o", "frames.h5")
    run(folder, "batch", *3 * ["unknown.h5"], *arguments[:-1], "-o", "batch")
    files = ["records.json", "live.jsonl", "frames.h5", "maps/A.map.h5", "unknown.h5", "batch"]
    visit(browser, paged("view", *files, "--page", "0"), 9)
    choice = Select(browser.find_element(By.ID, "file"))
    assert len(choice.options) == 6
    assert browser.title.startswith("E ") and "E (" in text(browser, "headline")
    blank = picture(browser, "robot")

    def scrub(to: int) -> None:
        script = "const r = document.getElementById('row'); r.value = arguments[0]; r.oninput()"
        browser.execute_script(script, to)

    scrub(2)
    wait(browser, lambda: touches(browser) == 3 and "touch 3 of 9" in text(browser, "scrub"))

    choice.select_by_index(1)
    wait(browser, lambda: touches(browser) == 4 and "unknown 1" in text(browser, "records"))
    assert "truth: E; error" in text(browser, "words")

    choice.select_by_index(2)
    wait(browser, lambda: "frame 1 of" in text(browser, "scrub"))
    untouched = picture(browser, "array")
    scrub(150)
    wait(browser, lambda: "frame 151 of" in text(browser, "scrub"))
    wait(browser, lambda: picture(browser, "array") != untouched)
    # Whoever drags ends where the slider is, whatever the order of the answers.
    browser.execute_script(
        "const r = document.getElementById('row');"
        "for (const to of [300, 0, 400, 120]) { r.value = to; r.oninput(); }"
    )
    wait(browser, lambda: "frame 121 of" in text(browser, "scrub"))

    choice.select_by_index(3)
    wait(browser, lambda: browser.title == "maps/A.map.h5")
    wait(browser, lambda: picture(browser, "robot") != blank)

    choice.select_by_index(4)
    wait(browser, lambda: "touch 1 of 9" in text(browser, "scrub"))

    choice.select_by_index(5)
    wait(browser, lambda: "3 of 3 records" in text(browser, "records"))
    browser.find_element(By.ID, "filter").send_keys("nothing such")
    wait(browser, lambda: "0 of 3 records" in text(browser, "records"))
    assert complaints(browser) == []


def test_show_serves_files_and_draws_what_is_in_memory(
    folder: pathlib.Path, maps: list[palpate.OccupancyGrid]
) -> None:
    command = os.environ["PALPATE_COMMAND"]
    page = palpate.show(folder / "maps" / "A.map.h5", command=command)
    assert isinstance(page, palpate.Page)
    with urllib.request.urlopen(page.url + "file/0") as answer:
        assert json.load(answer)["label"] == "A"
    assert f'<iframe src="{page.url}"' in page._repr_html_()
    page.close()
    with pytest.raises(palpate.Error, match="nothing.h5: no such file"):
        palpate.show(folder / "nothing.h5", command=command)
    axes = palpate.show(maps[0])
    assert not isinstance(axes, palpate.Page) and axes.get_xlabel() == "x, mm"


def run(folder: pathlib.Path, *arguments: str) -> None:
    """Runs the command in the folder."""
    command = [os.environ["PALPATE_COMMAND"], *arguments]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=120)
