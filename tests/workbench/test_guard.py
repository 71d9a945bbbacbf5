"""Who is answered: the page itself, and beyond this machine only who has the token."""

from __future__ import annotations

import socket

import pytest

from ee_dist.tasks.config import ConfigError
from ee_dist.viewing.web_viewer import cut_off
from ee_dist.workbench.guard import Guard

HERE = "127.0.0.1:8765"
SESAME = Guard(None, "sesame")


@pytest.mark.parametrize(("headers", "answered"), [
    ({"host": HERE}, True),
    ({"host": "localhost:8765", "origin": "http://localhost:8765"}, True),
    ({"host": HERE, "origin": "http://evil.example"}, False),
    ({"host": HERE, "origin": "http://127.0.0.1:9999"}, False),
    ({"host": HERE, "origin": "null"}, False),
    ({"host": "evil.example:8765"}, False),  # a name that was made to point here
    ({"host": "127.0.0.1.evil.example"}, False),
    ({"host": HERE, "sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, False),
    ({}, False),
])  # fmt: skip
def test_only_its_own_page_on_this_machine(headers, answered):
    assert Guard(None).allowed(headers, "") is answered


@pytest.mark.parametrize(("headers", "query", "answered"), [
    ({"host": "robot.lan:8765"}, "", False),
    ({"host": "robot.lan:8765"}, "token=wrong", False),
    ({"host": "robot.lan:8765"}, "token=sesame", True),
    ({"host": "robot.lan:8765", "cookie": f"{SESAME.cookie}=sesame"}, "", True),
    ({"host": "robot.lan:8765", "cookie": f"{SESAME.cookie}=sesame", "origin": "http://evil.example"}, "", False),
    ({"host": HERE}, "", False),
])  # fmt: skip
def test_others_need_the_token(headers, query, answered):
    assert SESAME.allowed(headers, query) is answered


def test_two_workbenches_on_one_port():
    serve = pytest.importorskip("ee_dist.workbench.serve", reason="needs the extra 'workbench'")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ConfigError, match=r"if another workbench is open there.*task\.port=0"):
            serve.bound("127.0.0.1", port)


def test_the_viewer_is_cut_off_from_elsewhere():
    page = '<html><head><link rel="x"\n href="https://fonts.example/a"/><link rel="icon" href="f.ico"/></head></html>'
    assert "fonts.example" not in cut_off(page) and "f.ico" in cut_off(page) and "window.fetch" in cut_off(page)


def test_without_the_toolkit_it_says_what_to_install(monkeypatch, tmp_path):
    from ee_dist.tasks.config import Config
    from ee_dist.workbench import task

    monkeypatch.setattr(task.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(ConfigError, match=r"pip install -c constraints.txt -e '\.\[workbench\]'"):
        task.run(Config(), task.Options(), tmp_path)
