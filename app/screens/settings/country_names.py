"""Names of countries in the language the app speaks; of those that are not here the library's English name is shown."""

from __future__ import annotations

from collections.abc import Mapping

from app.i18n import _


def in_language(names: Mapping[str, str]) -> dict[str, str]:
    """``names`` are English ones by ISO 3166 code; the same in order of the translated names."""
    known = translations()
    return dict(
        sorted(((code, known.get(code, name)) for code, name in names.items()), key=lambda item: item[1].casefold())
    )


def translations() -> dict[str, str]:
    return {
        "AR": _("Argentina"),
        "AT": _("Austria"),
        "AU": _("Australia"),
        "AX": _("Åland"),
        "BA": _("Bosnia and Herzegovina"),
        "BE": _("Belgium"),
        "BG": _("Bulgaria"),
        "BR": _("Brazil"),
        "BY": _("Belarus"),
        "CA": _("Canada"),
        "CH": _("Switzerland"),
        "CL": _("Chile"),
        "CN": _("China"),
        "CO": _("Colombia"),
        "CY": _("Cyprus"),
        "CZ": _("Czechia"),
        "DE": _("Germany"),
        "DK": _("Denmark"),
        "EE": _("Estonia"),
        "EG": _("Egypt"),
        "ES": _("Spain"),
        "FI": _("Finland"),
        "FO": _("Faroe Islands"),
        "FR": _("France"),
        "GB": _("United Kingdom"),
        "GL": _("Greenland"),
        "GR": _("Greece"),
        "HK": _("Hong Kong"),
        "HR": _("Croatia"),
        "HU": _("Hungary"),
        "ID": _("Indonesia"),
        "IE": _("Ireland"),
        "IL": _("Israel"),
        "IN": _("India"),
        "IS": _("Iceland"),
        "IT": _("Italy"),
        "JP": _("Japan"),
        "KR": _("South Korea"),
        "LI": _("Liechtenstein"),
        "LT": _("Lithuania"),
        "LU": _("Luxembourg"),
        "LV": _("Latvia"),
        "MA": _("Morocco"),
        "MC": _("Monaco"),
        "MD": _("Moldova"),
        "ME": _("Montenegro"),
        "MK": _("North Macedonia"),
        "MT": _("Malta"),
        "MX": _("Mexico"),
        "MY": _("Malaysia"),
        "NL": _("Netherlands"),
        "NO": _("Norway"),
        "NZ": _("New Zealand"),
        "PE": _("Peru"),
        "PH": _("Philippines"),
        "PL": _("Poland"),
        "PT": _("Portugal"),
        "RO": _("Romania"),
        "RS": _("Serbia"),
        "RU": _("Russia"),
        "SA": _("Saudi Arabia"),
        "SE": _("Sweden"),
        "SG": _("Singapore"),
        "SI": _("Slovenia"),
        "SK": _("Slovakia"),
        "TH": _("Thailand"),
        "TR": _("Turkey"),
        "TW": _("Taiwan"),
        "UA": _("Ukraine"),
        "US": _("United States"),
        "VN": _("Vietnam"),
        "ZA": _("South Africa"),
    }
