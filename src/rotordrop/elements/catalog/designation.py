"""Read a bearing designation as people write it: series, bore, contact angle, balls, clearance, pair."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import Literal

from rotordrop.elements.catalog.boundary import ClearanceClass

Kind = Literal["deep groove", "angular contact"]
Size = Literal["small", "standard"]

_MAKERS = (
    *("SKF", "FAG", "INA", "GMN", "NSK", "NTN", "SNR", "SNFA", "NACHI", "KOYO", "JTEKT", "TIMKEN", "FAFNIR"),
    *(
        "BARDEN",
        "IBC",
        "GRW",
        "ZKL",
        "URB",
        "KYK",
        "RHP",
        "SCHAEFFLER",
        "NORMA",
        "MRC",
        "STEYR",
        "NKE",
        "FLT",
    ),
)
_SERIES = {"68": "618", "69": "619", "78": "718", "79": "719"}
_BORES = {0: 10.0, 1: 12.0, 2: 15.0, 3: 17.0}
_CORE = re.compile(
    r"(?<!\d)(?P<series>618|619|718|719|60|62|70|72|68|69|78|79)"
    r"(?:\s*/\s*(?P<bore>\d{1,3})|\s?(?P<code>\d\d)|(?P<digit>[3-9]))(?!\d)"
)
_ANGLES = (
    (r"A5", 25.0),
    (r"AC[DBE]?|ADE?|AD", 25.0),
    (r"C[DBE]|C", 15.0),
    (r"BE[A-Z]*|BG?", 40.0),
    (r"E|D", 25.0),
    (r"A", 30.0),
)
_GLUED = re.compile(
    r"U?(?P<angle>A5|AD|C|A|B)(?:TRV?|TYN|TY|MR|M|W|T1|T)?(?:SN24)?(?:V1V)?"
    r"(?P<pair>D[BFTU]|SU)?(?P<load>EL|L|M|H)?(?:P[2-6]\w?)?G?"
)
"""How NSK and NTN write angle, cage, pair and preload in one word."""
_BORE_FIRST, _SERIES_OF = re.compile(r"(?<!\d)(\d{2,3})(BNR|BER)(10|19)(?!\d)"), {"10": "70", "19": "719"}
"""How NSK writes its spindle bearings of 18° (BNR) and 25°: bore [mm], family, series."""
_GLUED_ANGLES = {"A5": 25.0, "AD": 25.0, "C": 15.0, "A": 30.0, "B": 40.0}
_GLUED_LOADS: dict[str, Literal["light", "medium", "heavy"]] = {
    "EL": "light",
    "L": "light",
    "M": "medium",
    "H": "heavy",
}
_OF_ROLLERS = ("NU", "NJ", "NUP", "NF", "NN", "NNU")
"""Prefixes of cylindrical roller bearings."""
_SPINDLE_PREFIXES = ("S", "SM", "KH", "HYS", "HYSM", "HYKH")
_ARRANGEMENTS: dict[str, Literal["X", "O", "tandem"]] = {"DB": "O", "DF": "X", "DT": "tandem"}
_PRELOADS: dict[str, Literal["light", "medium", "heavy"]] = {
    **dict.fromkeys(("UL", "DUL", "GA", "DGA", "L", "GL"), "light"),
    **dict.fromkeys(("UM", "DUM", "GB", "DGB", "M", "GM"), "medium"),
    **dict.fromkeys(("UH", "DUH", "GC", "DGC", "H", "GH"), "heavy"),
}


@dataclass(frozen=True, kw_only=True)
class Designation:
    """What a designation says."""

    written: str
    """As it was written."""
    series: str
    """Bearing series of ISO 15 writing: 60, 62, 618, 619, 70, 72, 718 or 719."""
    bore: float
    """Bore [m]."""
    kind: Kind
    """Whether the grooves have shoulders on both sides."""
    contact_angle: float | None
    """Contact angle [rad]; None where the designation does not say it."""
    hybrid: bool
    """Ceramic balls."""
    balls: Size
    """Size of the balls within the series."""
    clearance_class: ClearanceClass | None
    """Class of ISO 5753."""
    preload_class: Literal["light", "medium", "heavy"] | None
    """"light", "medium" or "heavy"."""
    arrangement: Literal["X", "O", "tandem"] | None
    """Arrangement of a matched pair."""
    maker: str | None
    """Maker named."""
    prefix: str
    """Letters before the series."""
    goes_on: bool
    """Whether anything follows the bore."""
    unread: tuple[str, ...] = ()
    """Words of it that change nothing here: cage, seal, accuracy, grease, and what means nothing."""

    @property
    def basic(self) -> str:
        """Series and bore without prefixes and suffixes, such as "7016" or "619/8"."""
        millimetres = round(1e3 * self.bore, 6)
        codes = {bore: f"{code:02d}" for code, bore in _BORES.items()}
        if millimetres in codes:
            return self.series + codes[millimetres]
        if millimetres < 10.0 and self.series in ("60", "62", "70", "72"):
            return f"{self.series}{millimetres:.0f}"
        if 20.0 <= millimetres <= 480.0 and millimetres % 5.0 == 0.0:
            return f"{self.series}{millimetres / 5.0:02.0f}"
        return f"{self.series}/{millimetres:g}"


def read_designation(text: str) -> Designation | None:
    """Read a designation; None where no series of these bearings stands in it, or two in a list.

    Prefixes and suffixes of cage, seal, accuracy and grease say nothing here and are passed over.
    """
    read = _read(text)
    if read is None or sum(_read(part) is not None for part in re.split("[,;]", text)) > 1:
        return None
    words = [found for found in re.finditer(r"[A-Za-z0-9]+", text) if not _CORE.search(found[0].upper())]
    without = {found: _read(f"{text[: found.start()]} {text[found.end() :]}") for found in words}
    told = replace(read, written="", prefix="", goes_on=True)
    unread = [
        found[0]
        for found, other in without.items()
        if other is not None and replace(other, written="", prefix="", goes_on=True) == told
    ]
    return replace(read, unread=tuple(unread))


def _read(text: str) -> Designation | None:
    plain, maker = _without_maker(" ".join(text.upper().replace("_", " ").split()))
    plain = _BORE_FIRST.sub(lambda found: f"{found[2]}{_SERIES_OF[found[3]]}/{found[1]} ", plain)
    found = _CORE.search(plain)
    if found is None or (found["digit"] and len(found["series"]) != 2):
        return None
    series, bore = _SERIES.get(found["series"], found["series"]), _bore(found)
    prefix = re.sub(r"[^A-Z0-9]", "", plain[: found.start()])
    suffix = plain[found.end() :]
    if bore is None or len(prefix) > 6 or prefix in _OF_ROLLERS:
        return None
    angle = _contact_angle(suffix, found["series"], prefix)
    angular = series.startswith("7") or angle is not None
    return Designation(
        written=text.strip(),
        series=series,
        bore=1e-3 * bore,
        kind="angular contact" if angular else "deep groove",
        contact_angle=None if angle is None else math.radians(angle),
        hybrid=_is_hybrid(prefix, suffix),
        balls=_ball_size(prefix, suffix, angular),
        clearance_class=None if angular else _clearance_class(suffix),
        preload_class=_coded(suffix, _PRELOADS) if angular else None,
        arrangement=_arrangement(suffix),
        maker=maker,
        prefix=prefix,
        goes_on=bool(_tokens(suffix)),
    )


def _without_maker(text: str) -> tuple[str, str | None]:
    for maker in _MAKERS:
        without = re.sub(rf"(?<![A-Z0-9]){maker}(?![A-Z])[\s:-]*", " ", text)
        if without != text:
            return without.strip(), maker
    return text, None


def _bore(found: re.Match[str]) -> float | None:
    """Bore [mm]; codes below 04 have sizes of their own, others count in fives."""
    if found["bore"] is not None:
        return float(found["bore"]) or None
    if found["digit"] is not None:
        return float(found["digit"])
    code = int(found["code"])
    return _BORES.get(code, 5.0 * code)


def _tokens(suffix: str) -> list[str]:
    return re.findall(r"[A-Z0-9]+", suffix)


def _contact_angle(suffix: str, series: str, prefix: str) -> float | None:
    """Contact angle [°] that the first letters of a suffix say; None where they say none.

    Only spindle bearings of one maker write a contact angle on a series that begins with 6.
    """
    if prefix in ("BNR", "BER"):
        return 18.0 if prefix == "BNR" else 25.0
    tokens = _tokens(suffix)
    first = tokens[0] if tokens else ""
    if series.startswith("6") and (prefix not in _SPINDLE_PREFIXES or first not in ("C", "E")):
        return None
    for token in tokens[:2]:
        for pattern, angle in _ANGLES:
            if re.fullmatch(rf"(?:{pattern})(?:TA|T|Y|GA|GB|GC|P4S?|P2)?", token):
                return angle
        glued = re.match(r"(ACD|ACE|ACB|CD|CE|CB|AC|A5)(?=[A-Z0-9])", token)
        if glued:
            return 25.0 if glued[1].startswith("A") else 15.0
    word = _GLUED.fullmatch(first)
    return _GLUED_ANGLES[word["angle"]] if word else None


def _is_hybrid(prefix: str, suffix: str) -> bool:
    if re.match(r"HC|XC|HY|5S", prefix):
        return True
    return any(
        re.fullmatch(r"HC(5|P\d\w*|Q\w*|D[BFT]\w*)?(C\d\w*)?|SN24\w*|SI3N4|CERAMIC", t)
        for t in _tokens(suffix)
    )


def _ball_size(prefix: str, suffix: str, angular: bool) -> Size:
    """Families with many small balls: HS, HC, XC; KH; BNR, BER; suffixes CE, ACE, CB, ACB."""
    if not angular:
        return "standard"
    if re.match(r"HS|(?:HC|XC)S?$|(?:HY)?KH|BNR|BER", prefix):
        return "small"
    first = (_tokens(suffix) or [""])[0]
    return "small" if re.match(r"A?C[EB](?![A-Z]*M)", first) else "standard"


def _clearance_class(suffix: str) -> ClearanceClass | None:
    for token in _tokens(suffix):
        found = re.search(r"(?<!H)C([2-5])(?=$|[A-Z])", token)
        found = found or re.fullmatch(r"P[456]([2-5])", token)
        if found:
            classes: dict[str, ClearanceClass] = {"2": "C2", "3": "C3", "4": "C4", "5": "C5"}
            return classes[found[1]]
        if token in ("CN", "C0"):
            return "CN"
    return None


def _arrangement(suffix: str) -> Literal["X", "O", "tandem"] | None:
    for token in _tokens(suffix):
        found = re.match(r"(?:HC)?(?:P\d[AS]?)?(DB|DF|DT)(?:[A-C]|L|M|H|$)", token)
        if found:
            return _ARRANGEMENTS[found[1]]
    word = _GLUED.fullmatch((_tokens(suffix) or [""])[0])
    return _ARRANGEMENTS.get(word["pair"] or "") if word else None


def _coded(
    suffix: str, codes: dict[str, Literal["light", "medium", "heavy"]]
) -> Literal["light", "medium", "heavy"] | None:
    for token in _tokens(suffix)[1:]:
        bare = re.sub(r"^(?:HC)?(?:P\d[AS]?)?(?:D[BFT](?=[ABC]$))?", "", token)
        bare = re.sub(r"P\d+[A-Z]?$", "", bare)
        bare = f"G{bare}" if re.fullmatch(r"[ABC]", bare) else bare
        if bare in codes:
            return codes[bare]
    word = _GLUED.fullmatch((_tokens(suffix) or [""])[0])
    return _GLUED_LOADS.get(word["load"] or "") if word and word["pair"] else None
