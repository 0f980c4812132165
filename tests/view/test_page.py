# SPDX-License-Identifier: MIT
"""The page in a real browser, from fakeplc's registers to the letters on the screen."""
import hashlib
import json
import os
import re
import signal
import socket
import statistics
import time

import pytest
from selenium.webdriver.common.keys import Keys

from box import Box
from browser import SIZES
from plant import HEARTBEAT_TIMEOUT_S, HOSTILE, ROOT, View, write_file

PICTURES = ROOT / "build/view"
MINUS = "\u2212"
REGISTER_SIGN = -1  # this control moves against a positive value: `sign` of each channel


def seconds_until(page, act, shows):
    """out: seconds from the act to the moment in which the page shows it."""
    begin = time.monotonic()
    act()
    page.until(shows)
    return time.monotonic() - begin


def shows(selector, text):
    return f"return document.querySelector('{selector}').textContent.startsWith('{text}')"


def at_rest(plc, x, y, z):
    plc.command(f"move X={x} Y={y} Z={z} feed=20000")
    plc.wait(lambda status: not status["moving"])


def test_values_are_those_of_the_control_within_a_second(plc, page):
    took_s = [seconds_until(page, lambda: plc.command(f"signal TX_bearing {value}"),
                            shows('[data-signal="TX_bearing"] td', f"{value:.2f} °C"))
              for value in (21.5, 22.5, 21.75, 22.25, 21.25)]
    assert statistics.median(took_s) <= 1, took_s
    at_rest(plc, 300, 200, 100)
    for name, value in (("X", 300), ("Y", 200), ("Z", 100)):
        page.until(shows(f'[data-signal="{name}"] td', f"{value}.000 mm"))
    wanted_um = {"X": -8.7, "Y": 4.8, "Z": -3.6}  # EXX 6.75, EXZ -1.8, warm_bearing 3.75; EYY -4.8; EZZ 3.6
    status = plc.wait(lambda status: all(abs(REGISTER_SIGN * status[f"{what}_{name}"] - um) < 0.03
                                         for name, um in wanted_um.items() for what in ("commanded", "applied")))
    for name in wanted_um:  # the page shows both some hundred milliseconds later than the control has them
        for what, place in (("commanded", ".value"), ("applied", ".applied td.numbers")):
            page.until(f"return Math.abs(parseFloat(document.querySelector('[data-channel=\"{name}\"] {place}')"
                       f".textContent.replace('{MINUS}', '-')) - {REGISTER_SIGN * status[f'{what}_{name}']}) < 0.06")


def test_shares_add_up_to_the_demand(plc, page):
    plc.command("signal TX_bearing 21")
    at_rest(plc, 400, 250, 250)
    # EXX 9, EXZ 1.5, warm_bearing 3: the channel writes their negative sum
    for place in (".value", ".applied td.numbers"):  # the control follows in its own interpolation
        page.until(shows(f'[data-channel="X"] {place}', f"{MINUS}13.5 µm"))
    rows = page.run("return [...document.querySelectorAll('[data-channel=\"X\"] .shares tr:not([hidden])')]"
                    ".map(row => [row.querySelector('th').firstChild.textContent,"
                    " row.querySelector('td.numbers').textContent, row.querySelector('.bar div').style.width])")
    assert [row[:2] for row in rows] == [
        ["EXX", f"{MINUS}9.0 µm"], ["EXZ", f"{MINUS}1.5 µm"], ["warm_bearing", f"{MINUS}3.0 µm"],
        ["demand", f"{MINUS}13.5 µm"], ["output", f"{MINUS}13.5 µm"], ["applied", f"{MINUS}13.5 µm"]]
    assert rows[0][2] == "22.5%", "9 of 20 µm is 45 % of one side"
    assert page.text('[data-channel="X"] summary') == f"Why {MINUS}13.5 µm?"
    # by heat alone 52.5, in all 63: the limit cuts, and the page says so
    plc.command("signal TX_bearing 37.5")
    page.until_text('[data-channel="X"] .output th', "limited to ±60 µm")
    page.until(shows('[data-channel="X"] .value', f"{MINUS}60.0 µm"))
    page.until_text("#reason", "A channel is at its limit")


def test_a_frozen_control_is_hold_or_ramp_with_its_cause(plc, page):
    took_s = seconds_until(page, lambda: plc.command("freeze heartbeat 1"),
                           "return ['HOLD', 'RAMP'].includes(document.getElementById('mode').textContent)")
    assert took_s <= HEARTBEAT_TIMEOUT_S + 1
    assert page.text("#reason").startswith("The PLC's heartbeat does not change")
    plc.command("freeze heartbeat 0")
    page.until_text("#mode", "ACTIVE")
    page.until_text("#event-list", "HOLD: the PLC's heartbeat does not change")


def test_a_cause_is_named_with_value_and_bound(plc, page):
    plc.command("signal X 900")
    cause = page.until_text("#cause", "signal X")
    assert cause == "Cause: signal X reads 900 mm and its max is 810"
    page.until("return document.querySelector('[data-signal=X] .state').textContent !== 'fresh'")
    plc.command("signal X auto")
    page.until_text("#mode", "ACTIVE")
    page.until("return document.getElementById('cause').textContent === ''")


def test_a_silent_box_and_a_silent_server_are_grey_and_come_back(box, page, tmp_path):
    box.process.send_signal(signal.SIGSTOP)
    page.until_text("#mode", "NO NEWS")
    assert page.text("#meaning").startswith("The box does not write: no news for ")
    assert page.run("return document.body.classList.contains('old')")
    first = page.text("#meaning")
    page.until("return document.getElementById('meaning').textContent !== arguments[0]", first)
    box.process.send_signal(signal.SIGCONT)
    page.until_text("#mode", "ACTIVE")
    port = page.view.port
    page.view.kill()
    page.until_text("#mode", "NO CONNECTION")
    assert "The last mode was ACTIVE" in page.text("#reason")
    with View(tmp_path, port):
        page.until_text("#mode", "ACTIVE")
        assert not page.run("return document.body.classList.contains('old')")
        page.until("return document.querySelectorAll('#event-list li').length > 3")
        page.open("about:blank")
    page.logs()
    page.complaints.clear()  # the browser names each refused connection


STREAMS = 100  # that compbox-view serves at once


def test_a_refused_stream_is_asked_for_again(box, page):
    """Meanwhile the page asks for the state every two seconds."""
    page.open("about:blank")
    address = ("127.0.0.1", page.view.port)
    held = []
    while len(held) < STREAMS:  # that of the page before ends at once
        asked = [socket.create_connection(address) for _ in range(STREAMS - len(held))]
        for one in asked:
            one.sendall(b"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        held += [one for one in asked if one.recv(12) == b"HTTP/1.1 200"]
    page.open(page.view.url)
    page.until_text("#mode", "ACTIVE")
    assert page.run("return document.querySelectorAll('#event-list li').length") == 0
    for one in held:
        one.close()
    page.until("return document.querySelectorAll('#event-list li').length > 0")
    page.logs()
    page.complaints.clear()  # the browser names each reply 503


def test_a_page_that_was_left_gives_its_stream_back_and_takes_another(box, page):
    """Chromium keeps the page, and would keep its connection for minutes."""
    address = ("127.0.0.1", page.view.port)

    def is_there_room():
        held = [socket.create_connection(address) for _ in range(STREAMS)]
        for one in held:
            one.sendall(b"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        found = [one.recv(12) for one in held]
        for one in held:
            one.close()
        return found.count(b"HTTP/1.1 200") == STREAMS
    assert not is_there_room()
    page.open("about:blank")
    for _ in range(50):
        if is_there_room():
            break
        time.sleep(0.1)
    else:
        raise AssertionError("its stream is still there")
    page.driver.back()
    page.until_text("#mode", "ACTIVE")
    assert not page.run("return document.body.classList.contains('old')")


def test_a_reload_shows_both_files(plc, box, page, tmp_path):
    page.until_text("#file-list", "revision 1")
    write_file(tmp_path, plc.port, revision=2)
    text = page.until_text("#file-list", "revision 2")
    assert text.index("revision 2") < text.index("the one before") < text.index("revision 1")
    digest = hashlib.sha256((tmp_path / "coefficients.json").read_bytes()).hexdigest()
    page.until_text("#file-list", f"SHA-256 {digest[:12]}…, owned by user {os.getuid()}")
    with (tmp_path / "events.jsonl").open("a") as file:
        file.write(json.dumps({"kind": "commission", "crc": "01020304", "text": "commissioned mill 4"}) + "\n")
    page.until_text("#event-list", "commissioned mill 4")
    assert page.text("#file-list").index("revision 2") < page.text("#file-list").index("revision 1")


def test_a_box_that_ends_is_shown_as_ended(box, page):
    box.process.terminate()
    page.until_text("#mode", "STOPPED")
    page.until_text("#meaning", "compboxd ended")


def test_names_are_never_markup(plc, tmp_path, browser):
    file = write_file(tmp_path, plc.port, name=HOSTILE)
    with Box(file, "--snapshot", tmp_path / "snapshot.json", "--events", tmp_path / "events.jsonl"), \
            View(tmp_path) as view:
        browser.look("panel")
        browser.open(view.url)
        browser.until_text("#machine", HOSTILE)
        assert browser.run("return document.querySelectorAll('img').length") == 0
        browser.open("about:blank")


EVIL = "<b class=evil>x</b>"


def with_evil_texts(value):
    """A copy with each text replaced but the mode and its reason."""
    if isinstance(value, dict):
        return {key: one if key in ("mode", "reason", "crc") else with_evil_texts(one) for key, one in value.items()}
    if isinstance(value, list):
        return [with_evil_texts(one) for one in value]
    return EVIL if isinstance(value, str) else value


def test_no_text_of_a_file_is_markup_and_nodes_are_listed(box, page, tmp_path):
    """Every text of snapshot and events, as a program that writes these files could have them."""
    page.open("about:blank")
    snapshot = json.loads((tmp_path / "snapshot.json").read_text())
    event = json.loads((tmp_path / "events.jsonl").read_text().splitlines()[0])
    snapshot.update(can={"interface": "can0", "state": "up", "nodes": [{"node": 17, "state": "up", "boots": 2}]},
                    bus={"name": "cabinet", "connects": 1, "modules": [{"unit": 3, "answers": False}]},
                    cause={"text": "", "of": "", "name": ""})
    folder = tmp_path / "evil"
    folder.mkdir()
    (folder / "events.jsonl").write_text(json.dumps(with_evil_texts(event)) + "\n")

    def write():
        text = json.dumps(dict(with_evil_texts(snapshot), unix_s=time.time()))
        (folder / "new.json").write_text(text)
        (folder / "new.json").rename(folder / "snapshot.json")

    write()
    with View(folder) as view:
        page.open(view.url)
        page.until_text("#mode", "ACTIVE")
        page.run("document.getElementById('details').open = true")
        for caption in ("CAN", "CAN: nodes", "Sensor bus: modules"):
            write()
            page.until("return [...document.querySelectorAll('caption')].some(one => one.textContent === arguments[0])",
                       caption)
        for place in ("#machine", "#cause", "[data-channel] h3", "[data-channel] .shares th", "[data-signal] th",
                      ".signals h3", "#event-list .text", "#event-list .kind", "#detail-list td"):
            page.until_text(place, EVIL)
        assert page.run("return document.querySelectorAll('.evil').length") == 0
        page.open("about:blank")


def test_curves_begin_anew_when_the_clock_is_set_back(page):
    times = page.driver.execute_async_script("""
        const done = arguments[0];
        import('/columns.js').then(({append, columnsOf}) => {
          const columns = columnsOf(), seen = [];
          const channels = [{name: 'X', demand_um: 1, output_um: 1, applied_um: null, limit_um: 9}];
          for (const unix_s of [1000, 1000.2, 1000.2, 1010, 500, 500.2, 2000]) {
            append(columns, {unix_s, mode: 'ACTIVE', channels, signals: [{name: 'T', value: 2}]});
            const ends = [columns.unix_s, columns.mode, columns.channels.get('X').output_um, columns.signals.get('T')];
            seen.push([...new Set(ends.map(one => one.length)), columns.unix_s.at(-1)]);
          }
          done(seen);
        });""")
    # lengths of all columns, and the newest time; after a silence a row of nulls interrupts the curve
    assert times == [[1, 1000], [2, 1000.2], [2, 1000.2], [4, 1010], [1, 500], [2, 500.2], [4, 2000]]


def test_a_day_and_a_month_come_from_the_record(plc, page, tmp_path):
    at_rest(plc, 300, 200, 100)
    page.until(shows('[data-channel="Y"] .value', "4.8 µm"))
    for span in ("day", "month"):
        page.run("document.querySelector(`input[value=${arguments[0]}]`).click()", span)
        newest = page.until("const text = document.querySelector('[data-channel=Y] .legend').textContent;"
                            "return /output [^–]*µm/.test(text) && text")
        assert re.match(r"\d\d-\d\d \d\d:\d\d", newest), "a day is shown with its date"
        assert page.text("#history") == ""
    page.run("localStorage.clear()")
    with View(tmp_path) as without:
        page.open(without.url)
        page.until_text("#mode", "ACTIVE")
        page.run("document.querySelector('input[value=day]').click()")
        page.until_text("#history", "There is no record")
        page.run("localStorage.clear()")
        page.open("about:blank")


def overlapping(texts):
    """out: pairs of texts whose rectangles share more than a line's rounding."""
    def shared(a, b):
        wide = min(a["right"], b["right"]) - max(a["left"], b["left"])
        high = min(a["bottom"], b["bottom"]) - max(a["top"], b["top"])
        return wide > 1 and high > 0.3 * min(a["size"], b["size"])
    return [(a["text"], b["text"]) for i, a in enumerate(texts) for b in texts[i + 1:] if shared(a, b)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_it_is_legible_and_accessible(plc, box, page, axe, size, dark):
    page.look(size, dark)
    page.until(f"return document.documentElement.dataset.theme === '{'dark' if dark else 'light'}'")
    plc.command("move X=700 Y=50 Z=400 feed=3000")
    page.run("for (const one of document.querySelectorAll('details')) one.open = true")
    page.until("return document.querySelectorAll('#detail-list table').length > 2")
    page.until_drawn()
    for state in ("ACTIVE", "NO NEWS"):
        page.until_text("#mode", state)
        page.picture(PICTURES / f"{size}-{'dark' if dark else 'light'}-{state.replace(' ', '-').lower()}.png")
        violations = page.axe(axe)
        assert not violations, "\n".join(violations)
        texts = page.texts()
        assert overlapping(texts) == []
        width = SIZES[size][0]
        assert all(0 <= text["left"] and text["right"] <= width for text in texts), "nothing beyond the edge"
        assert page.run("return document.documentElement.scrollWidth") <= width
        assert min(text["size"] for text in texts) >= 13
        assert page.run("return parseFloat(getComputedStyle(document.getElementById('mode')).fontSize)") >= {
            "phone": 40, "panel": 90}[size], "readable from two metres on a panel"
        box.process.send_signal(signal.SIGSTOP)
    box.process.send_signal(signal.SIGCONT)


def test_nothing_jumps_while_values_change(plc, page):
    places = ("return [...document.querySelectorAll('.card, #status, h2, .legend, .legend .line')]"
              ".map(one => {const box = one.getBoundingClientRect(); return [box.left, box.top, box.width]})")
    before, seen = page.run(places), set()
    for x, z in ((50, 450), (750, 50)):
        plc.command(f"move X={x} Y=100 Z={z} feed=20000")
    while plc.status()["moving"]:
        seen.add(page.channel("X"))
        assert page.run(places) == before
    assert len(seen) > 5


def test_the_keyboard_reaches_everything(page):
    page.until_drawn()
    wanted = page.run("""
        const all = [...document.querySelectorAll('a[href], select, input, summary, [tabindex="0"]')];
        const first = new Set();
        return all.filter(one => one.checkVisibility())
          .filter(one => one.type !== 'radio' || (one.checked && !first.has(one.name) && first.add(one.name)))
          .map((one, i) => { one.dataset.reach = i; return i; });""")
    reached = []
    for _ in range(len(wanted) + 2):
        page.press(Keys.TAB)
        reached.append(page.run("return document.activeElement.dataset.reach ?? null"))
        outline = page.run("return getComputedStyle(document.activeElement).outlineStyle")
        assert reached[-1] is None or outline != "none", "focus is visible"
    assert [int(one) for one in reached if one is not None][:len(wanted)] == wanted
    # the curves' cursor
    page.run("document.querySelector('.channel .plot').focus()")
    newest = page.text(".channel .legend .time")
    page.press(Keys.ARROW_LEFT * 10)
    page.until("return document.querySelector('.channel .plot').getAttribute('aria-valuenow') !== "
               "document.querySelector('.channel .plot').getAttribute('aria-valuemax')")
    assert page.run("return document.querySelector('.channel .plot').getAttribute('aria-valuetext')").count("µm") == 3
    page.press(Keys.ESCAPE)
    page.until("return document.querySelector('.channel .legend .time').textContent >= arguments[0]", newest)
    # choices and details
    page.run("document.querySelector('input[value=limits]').focus()")
    page.press(Keys.ARROW_RIGHT)
    assert page.run("return document.querySelector('input[value=values]').checked")
    page.run("document.querySelector('#details summary').focus()")
    page.press(Keys.ENTER)
    page.until_text("#detail-list", "lateness of wake-ups")
    page.run("localStorage.clear()")


def test_the_choice_of_colours_stays(page):
    page.run("const theme = document.getElementById('theme'); theme.value = 'dark';"
             "theme.dispatchEvent(new Event('change'))")
    assert page.run("return document.documentElement.dataset.theme") == "dark"
    page.open(page.view.url)
    page.until("return document.documentElement.dataset.theme === 'dark'")
    page.run("localStorage.clear()")


def test_it_asks_nobody_else_and_complains_about_nothing(plc, page):
    """Last: of all tests before it, too."""
    page.until_drawn()
    plc.command("move X=100 Y=100 Z=100 feed=10000")
    plc.wait(lambda status: not status["moving"])
    requests, complaints = page.logs()
    assert len(requests) > 20
    outside = [url for url in requests if not url.startswith(("http://127.0.0.1:", "about:", "data:", "chrome"))]
    assert outside == [] and complaints == []
