"""Everything that uses a time zone imports from here, so the zone data are chosen before the first one is read."""

from app.domain.zone_data import use_newest

use_newest()
