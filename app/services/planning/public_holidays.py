"""Public holidays by country and region, offline, by the library ``holidays``.

It is imported when the first date is asked for, never at start: most plants choose no country, and reading it takes a third of a second.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from datetime import date
from functools import lru_cache
from types import MappingProxyType

from app.domain.models import InvalidInput

log = logging.getLogger(__name__)

NONE: Mapping[date, str] = MappingProxyType({})
YEARS = range(1950, 2100)  # for others the library is not reliable


@lru_cache(maxsize=1)
def countries() -> Mapping[str, str]:
    """ISO 3166 code -> English name, in order of the names."""
    from holidays.registry import COUNTRIES

    small = {"and", "of", "the"}
    names = {
        entry[1]: " ".join(word if word in small else word.capitalize() for word in module.split("_"))
        for module, entry in COUNTRIES.items()
    }
    return MappingProxyType(dict(sorted(names.items(), key=lambda item: item[1])))


@lru_cache(maxsize=64)
def subdivisions(country: str) -> Mapping[str, str]:
    """Regions of a country with their own holidays: code -> name, in order of the names. The code, if the library has
    no name."""
    import holidays

    if country not in countries():
        return MappingProxyType({})
    known = holidays.country_holidays(country)
    names: dict[str, str] = {code: code for code in known.subdivisions}
    for name, code in (known.subdivisions_aliases or {}).items():
        if names.get(code) == code:
            names[code] = name
    return MappingProxyType(dict(sorted(names.items(), key=lambda item: item[1])))


def check(country: str, subdivision: str) -> None:
    """Raises InvalidInput for a country or region that the library does not know. Both may be empty."""
    if country and country not in countries():
        raise InvalidInput("holiday_country", "the public holidays of {country} are not known here", country=country)
    if subdivision and subdivision not in subdivisions(country):
        raise InvalidInput(
            "holiday_subdivision", "{country} has no region {region}", country=country or "–", region=subdivision
        )


@lru_cache(maxsize=512)
def of_year(country: str, subdivision: str, year: int, language: str) -> Mapping[date, str]:
    """Date -> name, in ``language`` ("en", "fi") if the library has it, else in the country's own. Empty without a
    country."""
    if not country or year not in YEARS:
        return NONE
    import holidays

    try:
        known = holidays.country_holidays(country, subdiv=subdivision or None)
        spoken = _language(known.supported_languages, language) or known.default_language
        found = holidays.country_holidays(country, subdiv=subdivision or None, years=year, language=spoken)
        return MappingProxyType({day: name for day, name in sorted(found.items()) if day.year == year})
    except Exception:  # another version of the library may know less; a schedule must still find its next start
        log.exception("No public holidays of %s %s in %s", country, subdivision, year)
        return NONE


def _language(supported: Sequence[str], wanted: str) -> str | None:
    return next((language for language in sorted(supported, key=len) if language.partition("_")[0] == wanted), None)
