"""A robot's address: checked and normalised once, when it is entered."""

from __future__ import annotations

import functools
import ipaddress
import re
from dataclasses import dataclass

from app.domain.models import InvalidInput

_PARTS = re.compile(r"(?:(?P<scheme>[A-Za-z][A-Za-z0-9+.-]*)://)?(?P<rest>.*)", re.DOTALL)
_HOST_AND_PORT = re.compile(r"(?P<host>\[[^\]]*\]|[^:]*)(?::(?P<port>.*))?", re.DOTALL)
_LABEL = re.compile(r"[a-z0-9_](?:[a-z0-9_-]{0,61}[a-z0-9_])?")
DEFAULT_PORTS = {"http": 80, "https": 443}


class InvalidAddress(InvalidInput):
    """A text that can't be the address of a robot."""

    def __init__(self, msgid: str, **details: object) -> None:
        super().__init__("address", msgid, **details)


@dataclass(frozen=True)
class Address:
    """``host`` is lower case, an IPv6 one without brackets."""

    scheme: str
    host: str
    port: int

    @classmethod
    def parse(cls, text: str) -> Address:
        """``http://host[:port]``, ``https://…``, or a bare host or IP, which means http. Raises InvalidAddress."""
        stripped = text.strip()
        if not stripped:
            raise InvalidAddress("enter the robot's address, for example 192.168.12.20")
        if len(stripped) > 300 or not stripped.isprintable() or " " in stripped:
            raise InvalidAddress("an address has no spaces and at most 253 characters")
        match = _PARTS.fullmatch(stripped)
        scheme, rest = ((match["scheme"] or "http").lower(), match["rest"]) if match else ("http", stripped)
        if scheme not in DEFAULT_PORTS:
            raise InvalidAddress("an address begins with http:// or https://, not {scheme}://", scheme=scheme[:20])
        if "@" in rest:
            raise InvalidAddress("enter user name and password in their own fields, not in the address")
        rest = rest.removesuffix("/")
        if any(mark in rest for mark in "/?#\\"):
            raise InvalidAddress("leave out everything after the host and port, for example http://192.168.12.20")
        return cls(scheme, *_host_and_port(rest, DEFAULT_PORTS[scheme]))

    @property
    def url(self) -> str:
        """The normal form: scheme, host, and the port when it is not the scheme's own."""
        return f"{self.scheme}://{self.netloc}"

    @property
    def netloc(self) -> str:
        """Host and, if it is not the scheme's default, port: a robot's address as people know it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return host if self.port == DEFAULT_PORTS[self.scheme] else f"{host}:{self.port}"

    @property
    def is_secure(self) -> bool:
        return self.scheme == "https"

    def __str__(self) -> str:
        return self.url


@functools.lru_cache(1024)
def machine(text: str) -> tuple[str, int | None]:
    """The common part of two addresses of one machine: the host, and its port if that isn't a scheme's default. Raises
    InvalidAddress."""
    address = Address.parse(text)
    return address.host, None if address.port in DEFAULT_PORTS.values() else address.port


def _host_and_port(text: str, default_port: int) -> tuple[str, int]:
    if text.count(":") > 1 and not text.startswith("["):
        text = f"[{text}]"  # a bare IPv6 literal
    match = _HOST_AND_PORT.fullmatch(text)
    if match is None or match["host"].startswith("[") != match["host"].endswith("]"):
        raise InvalidAddress("{host} is not a host name or IP address", host=text[:80])
    return _host(match["host"]), _port(match["port"], default_port)


def _port(text: str | None, default: int) -> int:
    if text is None:
        return default
    if not (text.isascii() and text.isdigit() and len(text) <= 5 and 1 <= int(text) <= 65535):
        raise InvalidAddress("a port is a number from 1 to 65535")
    return int(text)


def _host(text: str) -> str:
    host = text.lower().removesuffix(".")
    if not host:
        raise InvalidAddress("the address has no host name or IP address")
    if host.startswith("["):
        return str(_usable(_ip(host[1:-1]) if "%" not in host else None, host))
    labels = host.split(".")
    if re.fullmatch(r"\d+|0x[0-9a-f]*", labels[-1]):  # no name ends so: it has to be an IPv4 address
        return str(_usable(_ip(host), host))
    if len(host) > 253 or not all(_LABEL.fullmatch(label) for label in labels):
        raise InvalidAddress("{host} is not a host name or IP address", host=host[:80])
    return host


@functools.lru_cache(1024)
def is_ip(host: str) -> bool:
    return _ip(host) is not None


def _ip(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        return None


def _usable(
    ip: ipaddress.IPv4Address | ipaddress.IPv6Address | None, text: str
) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    if ip is None:
        raise InvalidAddress("{host} is not a complete IP address", host=text[:80])
    if ip.is_unspecified or ip.is_multicast or str(ip) == "255.255.255.255":
        raise InvalidAddress("{host} is not the address of one device", host=str(ip))
    return ip
