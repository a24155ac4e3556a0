"""A Fleet Enterprise over HTTP and HTTPS, as a client reaches it."""

from __future__ import annotations

import pytest
import requests

from tests.integration.mir.servers import CERTIFICATES, FIELD
from tests.integration.sim.test_command import started

BOUND = 60.0
KEY = {"x-api-key": "mir_scheduler"}


@pytest.mark.filterwarnings("ignore:Unverified HTTPS request")  # it is self-signed
def test_with_a_certificate_it_is_reached_by_https() -> None:
    options = ("--port", "0", "--seed", "1", "--fleet", "enterprise", "--certificate", str(CERTIFICATES / FIELD))
    with started(*options) as (_process, [[_ready, name, url]]):
        assert (name, url.startswith("https://127.0.0.1:")) == ("Fleet", True)
        version = requests.get(f"{url}/api/v1/system/version", headers=KEY, timeout=BOUND, verify=False)
        assert version.json() == {"version": "1.5.0", "fleet-name": "Fleet"}
