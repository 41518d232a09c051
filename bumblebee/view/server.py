"""The page's server: viser on loopback, one port, one line that says where."""

import contextlib
import io
import logging
import os
import socket
import sys
import webbrowser

import viser

from bumblebee.errors import BadInput

HOST = "127.0.0.1"


def open_server(port: int) -> viser.ViserServer:
    """Start the server.

    Args:
        port: TCP port on loopback; 0 for a free one.

    Raises:
        BadInput: the port is taken, or may not be used.
    """
    try_port(port)
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # a browser's spare connections are no errors
    with contextlib.redirect_stdout(io.StringIO()):  # its own box with both addresses
        server = viser.ViserServer(host=HOST, port=port, label="BumbleBee", verbose=False)
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    return server


def stop(server: viser.ViserServer) -> None:
    """End the server, without its own farewell."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def address(server: viser.ViserServer) -> str:
    """The page's address."""
    return f"http://{HOST}:{server.get_port()}"


def show_page(url: str) -> str:
    """Open a browser where there is a display; returns the line that says what to do."""
    port = url.rpartition(":")[2]
    if has_display():
        try:
            if webbrowser.open(url):
                return f"{url}   (Ctrl-C ends it)"
        except webbrowser.Error:
            pass
    away = f"from another machine: ssh -L {port}:{HOST}:{port} <this machine>"
    return f"{url}   (no browser can be opened here: open the address in one; {away}; Ctrl-C ends it)"


def has_display() -> bool:
    """Whether a window can be opened here."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def try_port(port: int) -> None:
    """`BadInput` where a port is taken: viser would take the next free one and say nothing."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            why = error.strerror or str(error)
            raise BadInput(f"--port {port}", "a free port", why, "`--port 0` takes a free one.") from None
