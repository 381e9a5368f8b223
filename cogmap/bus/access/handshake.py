"""Finds out what is wrong with keys before a session is opened: Zenoh would only time out."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Callable
from contextlib import suppress

from cogmap.bus.access.certificates import now_utc, read_certificate
from cogmap.bus.access.keys import Keys
from cogmap.errors import AccessError

ANSWER_S = 3.0
_RECORD_BYTES = 65_536
# Python's ssl names reasons; of a certificate that cannot be verified, OpenSSL's codes do:
# see X509_verify_cert_error_string(3).
_UNKNOWN_ISSUER = {2, 18, 19, 20, 21}
_EXPIRED = {9, 10}
_WRONG_NAME = {62, 64}


def check(address: tuple[str, int], keys: Keys, answer_s: float = ANSWER_S) -> None:
    """Raise AccessError if the router at `address` and `keys` do not belong together, and OSError
    if nothing listens there.
    """
    where = f"the router at {address[0]}:{address[1]}"
    _check_own(keys)
    context = _context(keys)
    with socket.create_connection(address, answer_s) as link:
        talk = _Talk(link, context, address[0])
        try:
            talk.greet()
        except ssl.SSLCertVerificationError as error:
            raise AccessError(_distrusted(where, address[0], error, keys)) from None
        except OSError:
            raise AccessError(_silent(where)) from None
        try:
            talk.await_verdict()
        except TimeoutError:
            return
        except OSError as error:
            raise AccessError(_refused(where, error, keys)) from None


def speaks_tls(address: tuple[str, int], answer_s: float = ANSWER_S) -> bool:
    """Return whether what listens at `address` answers a greeting of TLS."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    with suppress(OSError), socket.create_connection(address, answer_s) as link:
        _Talk(link, context, address[0]).greet()
        return True
    return False


class _Talk:
    """TLS over `link`, as far as the verdict on our certificate.

    In TLS 1.3 that comes after our own last message, and a socket of Python's ssl would wait for
    data instead: what a router sends first of its own accord are tickets or an alert.
    """

    def __init__(self, link: socket.socket, context: ssl.SSLContext, host: str) -> None:
        self._link = link
        self._incoming = ssl.MemoryBIO()
        self._outgoing = ssl.MemoryBIO()
        self._tls = context.wrap_bio(self._incoming, self._outgoing, server_hostname=host)

    def greet(self) -> None:
        """Do the handshake. Raises OSError, of which ssl.SSLError is one."""
        while not self._step(self._tls.do_handshake):
            self._receive()

    def await_verdict(self) -> None:
        """Wait for what the router answers. Raises OSError."""
        self._receive()
        self._step(lambda: self._tls.read(1))

    def _step(self, step: Callable[[], object]) -> bool:
        """Go on as far as what has come allows. Returns whether it was enough."""
        try:
            step()
        except ssl.SSLWantReadError:
            return False
        finally:
            self._link.sendall(self._outgoing.read())
        return True

    def _receive(self) -> None:
        received = self._link.recv(_RECORD_BYTES)
        if not received:
            raise ConnectionResetError("it closed the connection")
        self._incoming.write(received)


def _check_own(keys: Keys) -> None:
    """Raise AccessError if our own certificate holds no longer, or not yet."""
    certificate = read_certificate(keys.certificate)
    now = now_utc()
    if certificate.not_valid_after_utc <= now:
        day = certificate.not_valid_after_utc.date()
        raise AccessError(f"the certificate of {keys.name} expired on {day}: {_renew(keys)}")
    if certificate.not_valid_before_utc > now:
        raise AccessError(
            f"the certificate of {keys.name} holds from {certificate.not_valid_before_utc} on: "
            "set the clock of this machine"
        )


def _context(keys: Keys) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    try:
        context.load_verify_locations(keys.authority)
        context.load_cert_chain(keys.certificate, keys.key)
    except OSError as error:
        raise AccessError(
            f"the keys in {keys.folder} do not belong together ({error}): {_renew(keys)}"
        ) from None
    return context


def _distrusted(where: str, host: str, error: ssl.SSLCertVerificationError, keys: Keys) -> str:
    if error.verify_code in _WRONG_NAME:
        return (
            f"the certificate of {where} does not name {host}: "
            f"add it with `cogmap keys make DIR --host {host}`, and restart the router"
        )
    if error.verify_code in _EXPIRED:
        return f"the certificate of {where} has expired: renew it with `cogmap keys make DIR`"
    if error.verify_code in _UNKNOWN_ISSUER:
        return (
            f"{where} is of another site than the keys in {keys.folder}: "
            "name the folder of its keys with --keys"
        )
    return f"the certificate of {where} is not accepted ({error.verify_message}): make new keys"


def _silent(where: str) -> str:
    return (
        f"{where} does not speak TLS, or hangs: start it with --keys too, "
        "or leave --keys and COGMAP_KEYS out here"
    )


def _refused(where: str, error: Exception, keys: Keys) -> str:
    reason = getattr(error, "reason", None) or ""
    if "EXPIRED" in reason:
        return f"{where} finds the certificate of {keys.name} expired: {_renew(keys)}"
    return (
        f"{where} does not accept the certificate of {keys.name} in {keys.folder}: "
        "it is not of this site's authority; name the folder of its keys with --keys"
    )


def _renew(keys: Keys) -> str:
    return f"renew it with `cogmap keys make {keys.folder.parent}`"
