"""Servers for a lab's people: the section `serve` of `lab.yaml`, and `tracking` on a machine without the database.

    serve:
      prefect: https://data.lab:4200         # as people open it
      mlflow: https://data.lab:5000
      prefect_listen: 0.0.0.0:4200           # of this machine; 127.0.0.1 where a proxy on it does TLS
      mlflow_listen: 0.0.0.0:5000
      certificate: /etc/bumblebee/data.pem   # left out behind a proxy
      key: /etc/bumblebee/data.key
      write: robotics                        # group of people who may log runs; left out: nobody
      promote: leads                         # group who may move champions and delete; left out: nobody

    tracking: https://data.lab:5000          # instead of everything else: stages log to that server

Beyond loopback there is no plain http, and nobody gets in without a login of their own (`flows/people/accounts.py`).
"""

import ipaddress
import re
import ssl
import stat
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from tasks.lab.servers import FILE, form

ADDRESS = re.compile(r"https://([a-z0-9]([a-z0-9.-]*[a-z0-9])?)(:([1-9][0-9]{0,4}))?")
GROUP = re.compile(r"[a-z][a-z0-9_-]{0,31}")
OPTIONAL = ("certificate", "key", "write", "promote")


@dataclass(frozen=True)
class ServeLab:
    """Where people reach both servers, and which groups of people may change what."""

    prefect: str
    """Address of Prefect's pages, `https://HOST[:PORT]`."""
    mlflow: str
    """Address of MLflow's pages, `https://HOST[:PORT]`."""
    prefect_listen: str
    """Where Prefect's server listens for it, `ADDRESS:PORT` of this machine."""
    mlflow_listen: str
    """Where MLflow's server listens for it."""
    certificate: str = ""
    """File with the certificate, and those between it and the authority; without, a proxy on this machine does TLS."""
    key: str = ""
    """File with its key, which only its owner can read."""
    write: str = ""
    """Group of people who may log runs."""
    promote: str = ""
    """Group of people who may also move aliases, change models and delete."""

    @property
    def addresses(self) -> dict[str, str]:
        """Addresses of both servers, by name."""
        return {"prefect": self.prefect, "mlflow": self.mlflow}

    @property
    def places(self) -> dict[str, tuple[str, int]]:
        """(address, port) where each server listens, by name."""
        texts = {"prefect": self.prefect_listen, "mlflow": self.mlflow_listen}
        return {name: (text.rpartition(":")[0], int(text.rpartition(":")[2])) for name, text in texts.items()}


def read_serve(workspace: Path) -> ServeLab | None:
    """The section `serve` of the workspace's `lab.yaml`; None where there is none. `tls` looks at its certificate.

    Raises:
        BadInput: for an unknown or missing key, another form, or no TLS.
    """
    path = Path(workspace) / FILE
    own = _content(path).get("serve")
    if own is None:
        return None
    names = [one.name for one in fields(ServeLab)]
    if not isinstance(own, dict):
        raise BadInput(f"{path}: serve", f"a mapping with {', '.join(names)}", type(own).__name__)
    for name in names:
        if name not in OPTIONAL and name not in own:
            raise BadInput(f"{path}: serve.{name}", "an address", "no such key")
    for name, value in own.items():
        if name not in names:
            raise BadInput(f"{path}: serve.{name}", " or ".join(names), "an unknown key")
        if not isinstance(value, str):
            raise BadInput(f"{path}: serve.{name}", "a text", type(value).__name__)
    made = ServeLab(**own)
    _check(made, f"{path}: serve")
    return made


def read_tracking(workspace: Path) -> str | None:
    """The address of the server to which the workspace's stages log; None where they write into the store.

    Raises:
        BadInput: for what is no https address, and beside sections that say something else.
    """
    path = Path(workspace) / FILE
    content = _content(path)
    if "tracking" not in content:
        return None
    if more := sorted(str(name) for name in set(content) - {"tracking"}):
        raise BadInput(f"{path}: {more[0]}", "nothing beside tracking", "another section")
    return require_server(content["tracking"], f"{path}: tracking")


def require_server(address: Any, where: str) -> str:
    """The address of a server of MLflow's; plain http on this machine alone.

    Raises:
        BadInput: for anything else.
    """
    here = isinstance(address, str) and re.fullmatch(r"http://(127\.0\.0\.1|localhost)(:[0-9]{1,5})?", address)
    if not here and (not isinstance(address, str) or not ADDRESS.fullmatch(address)):
        raise BadInput(where, "https://HOST[:PORT]", form(str(address)))
    return str(address)


def _content(path: Path) -> dict[str, Any]:
    content = read_yaml(path) if path.exists() else None
    return content if isinstance(content, dict) else {}


def _check(own: ServeLab, where: str) -> None:
    for name, url in own.addresses.items():
        found = ADDRESS.fullmatch(url)
        if not found or int(found[4] or 443) > 65535:
            raise BadInput(f"{where}.{name}", "https://HOST[:PORT], as people open it", form(url))
    if own.prefect == own.mlflow:
        raise BadInput(f"{where}.mlflow", "another address than Prefect's", "the same one")
    for group in ("write", "promote"):
        value = getattr(own, group)
        if value and not GROUP.fullmatch(value):
            raise BadInput(f"{where}.{group}", "a group's name in small letters", form(value))
    beyond = [name for name, text in _places(own, where).items() if not text.is_loopback]
    if beyond and not own.certificate:
        do = "Name certificate and key, or listen on 127.0.0.1 behind a proxy on this machine that does TLS."
        raise BadInput(f"{where}.{beyond[0]}_listen", "TLS beyond this machine", "no certificate", do)
    if bool(own.certificate) != bool(own.key):
        raise BadInput(f"{where}.certificate", "certificate and key together", "one of them")


def _places(own: ServeLab, where: str) -> dict[str, ipaddress.IPv4Address]:
    """Where each server listens."""
    found = {}
    for name, text in (("prefect", own.prefect_listen), ("mlflow", own.mlflow_listen)):
        host, _, port = text.rpartition(":")
        try:
            found[name] = ipaddress.IPv4Address(host)
            known = re.fullmatch("[1-9][0-9]{3,4}", port) and 1024 <= int(port) <= 65535
        except ValueError:
            known = None
        if not known:
            expected = "ADDRESS:PORT of this machine, such as 0.0.0.0:4200, with a port from 1024 to 65535"
            raise BadInput(f"{where}.{name}_listen", expected, form(text))
    return found


def tls(own: ServeLab, where: str = "serve") -> ssl.SSLContext:
    """The certificate and its key, ready to answer with.

    Raises:
        BadInput: for files that are not there, do not belong together, or a key that others can read.
    """
    for name in ("certificate", "key"):
        path = Path(getattr(own, name))
        if not path.is_absolute() or not path.is_file():
            came = f"{path}: no such file" if path.is_absolute() else "no whole path"
            raise BadInput(f"{where}.{name}", "a file, by its whole path", came)
    if stat.S_IMODE(Path(own.key).stat().st_mode) & 0o077:
        raise BadInput(f"{where}.key", "a file that only its owner can read", own.key, f"chmod 600 {own.key}")
    made = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    made.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        made.load_cert_chain(own.certificate, own.key, password=lambda: "")
    except (ssl.SSLError, OSError, ValueError) as error:
        do = "Both as PEM, the key without a passphrase."
        raise BadInput(f"{where}.certificate", "a certificate and its key", str(error)[:120], do) from None
    return made
