"""Refuse every request to the page of a scene that does not come from that page.

Whoever reaches the page moves the hand, also another website in the same browser. So the server
listens on this machine only. It answers a request only if the Host header names this machine and
the path begins with the random word of the address. A web socket must also come from the page
itself (Origin header). Another website cannot learn the word.
"""

from __future__ import annotations

import hmac
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any

HOST = "127.0.0.1"


@contextmanager
def guarded(word: str) -> Iterator[None]:
    """Make the server that viser starts inside this context refuse what is not `allowed`.

    Viser has no option for this. So meanwhile the start function of its websockets library is
    replaced.

    Raises
    ------
    RuntimeError
        This version of viser started its server in another way: requests would not be checked.
    """
    from websockets.asyncio import server

    serve = server.serve
    started = False

    def serve_guarded(*arguments: Any, process_request: Callable[..., Any], **options: Any) -> Any:
        def answer(connection: Any, request: Any) -> Any:
            if not allowed(request.path, request.headers, connection.local_address[1], word):
                return connection.respond(HTTPStatus.FORBIDDEN, "open the address of iapb view\n")
            request.path = "/" + request.path.removeprefix(f"/{word}").lstrip("/")
            return process_request(connection, request)

        nonlocal started
        started = True
        return serve(*arguments, process_request=answer, **options)

    server.serve = serve_guarded  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]
    if not started:
        raise RuntimeError("viser started its server unguarded: requests would not be checked")


def allowed(path: str, headers: Any, port: int, word: str) -> bool:
    """Return whether a request names this machine and has the word; a web socket, its origin."""
    host = f"{HOST}:{port}"
    origin = headers.get_all("Origin")
    is_page = not origin and not headers.get_all("Upgrade")
    if headers.get_all("Host") != [host] or not (is_page or origin == [f"http://{host}"]):
        return False
    return hmac.compare_digest(path[1 : 1 + len(word)].encode(errors="replace"), word.encode())
