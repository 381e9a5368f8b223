"""Certificates: a site's authority, and those that it issues. Pure: time and hosts are given."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from cogmap.errors import AccessError

AUTHORITY_NAME = "Cogmap site authority"
AUTHORITY_DAYS = 3650
CLOCK_SKEW = timedelta(minutes=5)
"""A certificate holds from a little before it was made: the other machine's clock may be late."""


class Issued(NamedTuple):
    """A certificate and its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def make_authority(now: datetime) -> Issued:
    """Make the authority of a new site."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, AUTHORITY_NAME)])
    builder = _builder(name, name, key, now, timedelta(days=AUTHORITY_DAYS))
    builder = builder.add_extension(x509.BasicConstraints(True, 0), critical=True)
    builder = builder.add_extension(_usage(signs_certificates=True), critical=True)
    return Issued(builder.sign(key, hashes.SHA256()), key)


def issue(
    authority: Issued, name: str, now: datetime, lasts: timedelta, hosts: Sequence[str] = ()
) -> Issued:
    """Issue a certificate with the common name `name`. One with `hosts` may listen there; with any
    other its holder can only connect, so that nobody but the router can pass for it.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    ends = authority.certificate.not_valid_after_utc - now
    builder = _builder(subject, authority.certificate.subject, key, now, min(lasts, ends))
    builder = builder.add_extension(x509.BasicConstraints(False, None), critical=True)
    builder = builder.add_extension(_usage(signs_certificates=False), critical=True)

    purposes = [ExtendedKeyUsageOID.CLIENT_AUTH]
    if hosts:
        purposes.append(ExtendedKeyUsageOID.SERVER_AUTH)
    builder = builder.add_extension(x509.ExtendedKeyUsage(purposes), critical=False)
    names = [_general_name(host) for host in hosts or [name]]
    builder = builder.add_extension(x509.SubjectAlternativeName(names), critical=False)
    signer = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key())
    builder = builder.add_extension(signer, critical=False)
    return Issued(builder.sign(authority.key, hashes.SHA256()), key)


def hosts_of(certificate: x509.Certificate) -> list[str]:
    """Return the hosts that a router's certificate names."""
    named = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    addresses = [str(address) for address in named.get_values_for_type(x509.IPAddress)]
    return [*named.get_values_for_type(x509.DNSName), *addresses]


def is_issued_by(authority: x509.Certificate, certificate: x509.Certificate) -> bool:
    """Return whether `authority` has signed `certificate`."""
    try:
        certificate.verify_directly_issued_by(authority)
    except Exception:  # of several kinds, as what is wrong with the signature
        return False
    return True


def read_certificate(path: Path) -> x509.Certificate:
    """Read a certificate. Raises AccessError."""
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None


def read_key(path: Path) -> ec.EllipticCurvePrivateKey:
    """Read a private key. Raises AccessError."""
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), None)
    except (OSError, ValueError, TypeError) as error:
        raise _unreadable(path, error) from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise _unreadable(path, "it is of another kind")
    return key


def pem_of_certificate(issued: Issued) -> bytes:
    """Encode the certificate."""
    return issued.certificate.public_bytes(serialization.Encoding.PEM)


def pem_of_key(issued: Issued) -> bytes:
    """Encode the private key."""
    return issued.key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def now_utc() -> datetime:
    """Return the time by which certificates are judged."""
    return datetime.now(UTC)


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    now: datetime,
    lasts: timedelta,
) -> x509.CertificateBuilder:
    identifier = x509.SubjectKeyIdentifier.from_public_key(key.public_key())
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_SKEW)
        .not_valid_after(now + lasts)
        .add_extension(identifier, critical=False)
    )


def _usage(signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _unreadable(path: Path, reason: object) -> AccessError:
    said = reason.strerror if isinstance(reason, OSError) else reason
    return AccessError(
        f"cannot read {path} ({said}): make a folder of keys with `cogmap keys make DIR`"
    )
