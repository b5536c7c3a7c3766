"""One uvicorn server on one socket, within the event loop of its process."""

import asyncio
import contextlib
import socket
from collections.abc import Iterator
from typing import Any

import uvicorn

from groundstation.console.access import Asgi
from groundstation.console.network import Network


class WebServer(uvicorn.Server):
    """A server that handles no signals: its process does, and stops it."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to the process."""
        yield


def serve(
    app: Asgi, listener: socket.socket, http: type[Any], network: Network | None = None
) -> tuple[WebServer, "asyncio.Task[None]"]:
    """Start to serve; returns the server (set its `should_exit` to end it) and its task.

    http: uvicorn's protocol class of a connection; network: its TLS certificate is used, for devices.
    """
    config = uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        log_level="warning",
        lifespan="off",
        ws="websockets-sansio",
        http=http,
        ws_max_size=16 * 1024,
        ws_per_message_deflate=False,
        ws_ping_interval=10.0,
        ws_ping_timeout=20.0,
        server_header=False,
        timeout_graceful_shutdown=1,
        limit_concurrency=400,
        ssl_certfile=network.certificate if network else None,
        ssl_keyfile=network.key if network else None,
    )
    server = WebServer(config)
    return server, asyncio.create_task(server.serve(sockets=[listener]))
