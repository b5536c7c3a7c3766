"""The smallest WebSocket server of the same framework: it echoes each message.

Run as `python -m groundstation.bench.console_peer DESCRIPTOR` with a listening socket inherited under that number.
"""

import asyncio
import socket
import sys

import uvicorn
from starlette.applications import Starlette
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect


async def _echo(page: WebSocket) -> None:
    await page.accept()
    try:
        while (message := await page.receive())["type"] == "websocket.receive":
            if (text := message.get("text")) is not None:
                await page.send_text(text)
            else:
                await page.send_bytes(message["bytes"])
    except WebSocketDisconnect:
        pass


def main() -> None:
    """Serve until killed, with the settings of the console's own server."""
    application = Starlette(routes=[WebSocketRoute("/ws", _echo)])
    config = uvicorn.Config(
        application, log_config=None, access_log=False, lifespan="off", ws="websockets-sansio", http="h11",
        ws_per_message_deflate=False,
    )  # fmt: skip
    asyncio.run(uvicorn.Server(config).serve(sockets=[socket.socket(fileno=int(sys.argv[1]))]))


if __name__ == "__main__":
    main()
