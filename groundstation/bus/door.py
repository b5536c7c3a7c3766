"""Finds why a guarded router refuses this member, or that nobody answers, by a TLS handshake of our own.

Zenoh reports every failure alike: it cannot open a session.
"""

import socket
import ssl
from contextlib import suppress
from pathlib import Path

from groundstation.bus.roles import Identity
from groundstation.bus.zenoh_bus import AUTHORITY, CERTIFICATE, KEY

_PATIENCE_S = 1.0
# OpenSSL's numbers (x509_vfy.h): not yet valid and expired; another name and another address than the certificate's.
_OUT_OF_DATE, _ELSEWHERE = (9, 10), (62, 64)


def why_closed(endpoint: str, identity: Identity, silent: str = "", admitted: str = "") -> str:
    """Return why the router at an endpoint and this member do not trust each other, with the remedy.

    "": nobody listens there. silent: returned if nothing there answers, so that nobody knows; admitted: if it is let
    in.
    """
    host, _, port = endpoint.rpartition("/")[2].rpartition(":")
    try:
        context = _context(identity)
    except OSError as error:  # which those of TLS are, too
        why = getattr(error, "reason", "") or error.strerror
        return f"the certificate of this host cannot be used ({why}): admit and join this host anew"
    try:
        with socket.create_connection((host, int(port)), _PATIENCE_S) as raw:
            return _knock(context, raw, host) or admitted
    except ConnectionRefusedError:
        return ""
    except OSError:
        return silent


def _context(identity: Identity) -> ssl.SSLContext:
    folder = Path(identity.folder)
    context = ssl.create_default_context(cafile=str(folder / AUTHORITY))
    context.load_cert_chain(folder / f"{identity.name}{CERTIFICATE}", folder / f"{identity.name}{KEY}")
    return context


def _knock(context: ssl.SSLContext, raw: socket.socket, host: str) -> str:
    try:
        guarded = context.wrap_socket(raw, server_hostname=host)
        # In TLS 1.3 a refusal follows the handshake; an admitted member gets nothing yet.
        with guarded, suppress(TimeoutError):
            guarded.recv(1)
    except ssl.SSLCertVerificationError as error:
        return _mistrust(error, host)
    except ssl.SSLError as error:
        return f"the run there refuses the certificate of this host ({error.reason}): admit and join this host anew"
    return ""


def _mistrust(error: ssl.SSLCertVerificationError, host: str) -> str:
    if error.verify_code in _OUT_OF_DATE:
        return "the certificates are out of date by the clock of this host: set its date"
    if error.verify_code in _ELSEWHERE:
        return f"the run there is certified for other addresses than {host}: set bus.listen to {host}, or admit anew"
    return (
        "who listens there is not vouched for by the site that admitted this host: its authority was made anew "
        "(admit and join this host again), or it is another program"
    )
