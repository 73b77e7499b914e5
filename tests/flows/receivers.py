"""Who may be told of something: a web hook and a mail server on this machine, which keep what they are sent."""

from __future__ import annotations

import socketserver
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

Kept = list[str]


@contextmanager
def web_hook() -> Iterator[tuple[str, Kept]]:
    """Its address, and the bodies of what is posted to it."""
    kept = Kept()

    class Hook(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            kept.append(self.rfile.read(int(self.headers["Content-Length"])).decode())
            self.send_response(204)
            self.end_headers()

        def log_message(self, *said: object) -> None:
            """Nothing."""

    with _served(ThreadingHTTPServer(("127.0.0.1", 0), Hook)) as port:
        yield f"http://127.0.0.1:{port}/hook", kept


@contextmanager
def mail_server() -> Iterator[tuple[str, Kept]]:
    """Its address in the form of Apprise, and the mails that it takes from whoever comes (RFC 5321, what is needed)."""
    kept = Kept()

    class Mails(socketserver.StreamRequestHandler):
        timeout = 30

        def handle(self) -> None:
            self.wfile.write(b"220 here\r\n")
            for line in self.rfile:
                word = line[:4].upper()
                if word == b"DATA":
                    self.wfile.write(b"354 go on\r\n")
                    kept.append(b"".join(iter(self.rfile.readline, b".\r\n")).decode())
                self.wfile.write(b"221 bye\r\n" if word == b"QUIT" else b"250 well\r\n")
                if word == b"QUIT":
                    return

    with _served(socketserver.ThreadingTCPServer(("127.0.0.1", 0), Mails)) as port:
        yield f"mailto://127.0.0.1:{port}?from=shoal@example.org&to=me@example.org", kept


@contextmanager
def _served(server: socketserver.TCPServer) -> Iterator[int]:
    """Its port, as long as the block lasts."""
    server.block_on_close = False  # type: ignore[attr-defined]
    thread = Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield int(server.server_address[1])
    finally:
        server.shutdown()
        server.server_close()
        thread.join(30)
