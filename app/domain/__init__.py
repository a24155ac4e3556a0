"""Everything that uses a time zone imports from here, so the zone data are chosen before the first one is read."""

from app.domain.clock import use_newest_zone_data

use_newest_zone_data()
