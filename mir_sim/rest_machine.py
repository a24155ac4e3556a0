"""A machine with MiR's REST API at /api/v2.0.0: a robot or a classic fleet."""

from __future__ import annotations

from mir_sim.definition import Definition
from mir_sim.machine import Machine
from mir_sim.profile import Profile
from mir_sim.site import Row, Site


class RestMachine(Machine):
    """What the operations need that only read and write stored data.

    Attributes:
        definition: MiR's own of the API.
        software: version that the definition is of.
        model: as the headers of answers name it.
        site: the stored data.
        search_status: status code of POST …/search; None: there is none.
    """

    definition: Definition
    software: str
    model: str
    profile: Profile
    site: Site

    @property
    def search_status(self) -> int | None:
        return 201 if self.profile.search else None

    def file_report(self, module: str, description: str) -> Row:
        """Add to /log/error_reports."""
        table = self.site.table("/log/error_reports")
        number = max((int(row["id"]) for row in table), default=0) + 1
        return table.add(
            {
                "id": number,
                "ready": True,
                "module": module,
                "description": description,
                "time": self.stamp(),
                "download_url": f"/v2.0.0/log/error_reports/{number}/download",
                "generating": False,
            }
        )
