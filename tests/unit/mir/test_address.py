import pytest

from app.domain.models import InvalidInput
from app.mir.address import Address, InvalidAddress


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("192.168.12.20", "http://192.168.12.20"),
        ("  http://192.168.12.20/  ", "http://192.168.12.20"),
        ("HTTP://Mir.Com:80", "http://mir.com"),
        ("mir.com.", "http://mir.com"),
        ("https://robot-3.plant.local:443", "https://robot-3.plant.local"),
        ("https://10.0.0.7:8443", "https://10.0.0.7:8443"),
        ("http://robot:443", "http://robot:443"),
        ("localhost:8080", "http://localhost:8080"),
        ("127.0.0.1:65535", "http://127.0.0.1:65535"),
        ("mir_201605123", "http://mir_201605123"),
        ("[::1]:8080", "http://[::1]:8080"),
        ("http://[FE80:0::1]", "http://[fe80::1]"),
        ("::1", "http://[::1]"),
    ],
)
def test_an_address_is_normalised(text: str, url: str) -> None:
    address = Address.parse(text)
    assert address.url == url
    assert Address.parse(address.url) == address
    assert Address.parse(str(address)) == address


@pytest.mark.parametrize(
    ("text", "part_of_reason"),
    [
        ("", "enter the robot's address"),
        ("   ", "enter the robot's address"),
        ("ftp://robot", "not ftp://"),
        ("http://", "no host name"),
        ("http://:80", "no host name"),
        ("http://admin:secret@robot", "their own fields, not in the address"),
        ("http://robot/api/v2.0.0", "leave out everything after"),
        ("robot?x=1", "leave out everything after"),
        ("robot#top", "leave out everything after"),
        ("robot\\share", "leave out everything after"),
        ("robot one", "no spaces"),
        ("robot\nHost: evil", "no spaces"),
        ("robot:0", "from 1 to 65535"),
        ("robot:65536", "from 1 to 65535"),
        ("robot:", "from 1 to 65535"),
        ("robot:８０", "from 1 to 65535"),
        ("192.168.12.300", "not a complete IP address"),
        ("192.168.12", "not a complete IP address"),
        ("0x7f.1", "not a complete IP address"),
        ("0", "not a complete IP address"),
        ("[::1", "not a host name or IP address"),
        ("[nonsense]", "not a complete IP address"),
        ("[fe80::1%eth0]", "not a complete IP address"),
        ("0.0.0.0", "not the address of one device"),
        ("224.0.0.1", "not the address of one device"),
        ("255.255.255.255", "not the address of one device"),
        ("-robot", "not a host name or IP address"),
        ("röbot", "not a host name or IP address"),
        ("a" * 64, "not a host name or IP address"),
        ("a." * 200, "at most 253 characters"),
    ],
)
def test_an_invalid_address_is_refused_with_one_sentence(text: str, part_of_reason: str) -> None:
    with pytest.raises(InvalidAddress) as refused:
        Address.parse(text)
    assert part_of_reason in refused.value.text
    assert refused.value.field == "address"
    assert isinstance(refused.value, InvalidInput)
    assert "secret" not in refused.value.text
