"""The server of the page: one session, one port, nothing served but the page, its viewer and the session's own folder."""

from __future__ import annotations

import logging
import os
import secrets
import socket
import sys
import webbrowser
from dataclasses import replace
from pathlib import Path

import uvicorn
from fastapi import FastAPI, HTTPException, Request, Response
from fastapi.middleware.gzip import GZipMiddleware
from fastapi.responses import FileResponse
from nicegui import app as toolkit
from nicegui import ui

from ee_dist import beginning
from ee_dist.effects.model_file import read_model
from ee_dist.robots.describe import robot_of
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.errors import defect
from ee_dist.tasks.terminal import terminal
from ee_dist.viewing.web_viewer import WebViewerError, web_viewer
from ee_dist.workbench import saved
from ee_dist.workbench.commands import going_on
from ee_dist.workbench.drawing import ADDRESS, plotly
from ee_dist.workbench.guard import Guard, is_loopback
from ee_dist.workbench.pages.opening import show_session
from ee_dist.workbench.session import Session

TITLE = "ee_dist workbench"
EVERYWHERE = ("0.0.0.0", "::")
TURN_S = 0.0005
"""After which a thread that computes lets the others in. A page and its files are answered in a thousand small steps, and each of
them would wait ten times as long while the session's thread is at work."""


def bound(host: str, port: int) -> socket.socket:
    """A listening socket. Raises ConfigError where something listens there already, or the address is none of ours."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    sock = socket.socket(family, socket.SOCK_STREAM)
    if os.name == "posix":
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        sock.bind((host, port))
        sock.listen(64)
    except OSError as error:
        sock.close()
        if port:
            raise ConfigError(
                f"task.port={port}: {error.strerror or error}; if another workbench is open there, look at "
                f"http://{host}:{port}, or take a free port with task.port=0"
            ) from None
        raise ConfigError(f"task.host={host}: {error.strerror or error}; 127.0.0.1 is this machine") from None
    return sock


def serve(config: Config, by: str, host: str, port: int, show: bool, out: Path) -> None:
    """Answer until ended. What cannot be opened is said before anything is served."""
    log = Path(config.log) if config.log else None
    kept = None
    if log is not None and saved.is_session(log):
        kept, log = saved.read(log), None
        config, by = replace(config, engine=replace(config.engine, name=kept.engine)), kept.by
    sys.setswitchinterval(TURN_S)
    session = Session(config, by, out)
    if kept is not None:
        session.reopen(kept)
    elif log is not None:
        # Only here: what tells of a run takes its time to load.
        from ee_dist.workbench.pages.recovery import show_recovery

        show_recovery(log, out)
    elif config.measured:
        session.load(config.measured, config.model)
    else:
        # Wrong ones are said now, not when a log is dropped.
        robot_of(config.robot.name, config.robot.urdf, config.robot.drives)
        if config.model:
            read_model(config.model)
    sock = bound(host, port)
    token = "" if is_loopback(host) else secrets.token_urlsafe(24)
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    _files(app, out)
    if log is None:
        show_session(session)
    if session.measured is not None:
        session.attempt(session.begin)
    # What nobody foresaw goes to a file and, in a line, to the page: the terminal stays readable.
    toolkit.on_exception(lambda error: session.say(defect(error, out)))
    for name in ("nicegui", "uvicorn", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    # To squeeze what is sent takes longer than to hand it over, unless a network lies between.
    squeeze = GZipMiddleware if token else None
    ui.run_with(
        app,
        title=TITLE,
        dark=None,
        show_welcome_message=False,
        reconnect_timeout=20.0,
        gzip_middleware_factory=squeeze,
        tailwind=False,
    )
    # Neither the collector nor the toolkit, which looks for its server, goes through what is loaded by now.
    beginning.loaded()
    settings = uvicorn.Config(
        Guard(app, token),
        log_config=None,
        access_log=False,
        timeout_graceful_shutdown=1,
        ws_per_message_deflate=bool(token),
    )
    server = uvicorn.Server(settings)
    # Who comes from elsewhere asks for this machine by its name.
    named = host if host not in EVERYWHERE else socket.gethostname()
    address = f"http://{named if ':' not in named else f'[{named}]'}:{sock.getsockname()[1]}/"
    address += f"?token={token}" if token else ""
    console = terminal()
    console.print(f"The workbench: {address} (Ctrl-C ends it)", highlight=False, soft_wrap=True)
    sys.stdout.flush()
    if show and (os.environ.get("DISPLAY") or sys.platform in ("darwin", "win32")):
        webbrowser.open(address)
    try:
        server.run(sockets=[sock])
    finally:
        session.close()
        sock.close()
        if session.measured is not None:
            console.print(f"To go on: {going_on(out)}", highlight=False, soft_wrap=True)


def _files(app: FastAPI, folder: Path) -> None:
    """What is served besides the page: what its charts are drawn with, files of the session's folder, and the viewer."""
    root = folder.resolve()

    @app.get("/files/{path:path}")
    def file(path: str) -> FileResponse:
        found = (root / path).resolve()
        if not found.is_relative_to(root) or not found.is_file() or any(p.startswith(".") for p in Path(path).parts):
            raise HTTPException(404)
        return FileResponse(found)

    @app.get(ADDRESS)
    def library(request: Request) -> Response:
        script = plotly()
        headers = {"cache-control": "no-cache", "etag": script.tag}
        if request.headers.get("if-none-match") == script.tag:
            return Response(status_code=304, headers=headers)
        return Response(script.content, media_type="text/javascript", headers=headers)

    @app.get("/viewer/{name:path}")
    def viewer(name: str) -> Response:
        try:
            part = web_viewer().get(name or "index.html")
        except WebViewerError as error:
            return Response(str(error), status_code=503, media_type="text/plain")
        if part is None:
            raise HTTPException(404)
        headers = {"cache-control": "public, max-age=3600", "rerun-final-length": str(len(part.content))}
        return Response(part.content, media_type=part.kind, headers=headers)
