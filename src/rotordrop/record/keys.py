"""Keys of heads, attributes and variables, as recorders write them: what each tells, the clock they give."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.record.recording import TIME_NAMES, known_unit, split_unit
from rotordrop.units import parse_quantity

_KEYS = {
    "step": "dt step increment timestep sampletime sampleinterval samplinginterval samplingperiod "
    "sampleperiod abtastintervall schrittweite deltax deltat xinc xincrement wfincrement hresolution ts "
    "isi tinterval interval samplingtime timeincrement timeinterval timeresolution deltatime scaninterval "
    "stepsize xstep xdelta horizinterval horizontalinterval horizontalresolution abtastzeit abtastperiode "
    "zykluszeit cycletime tsample tsamp samplespacing xresolution xspacing pasdetemps "
    "periodedechantillonnage шагдискретизации периоддискретизации 采样间隔 采样周期",
    "rate": "fs samplerate samplingrate samplingfrequency samplefrequency abtastrate abtastfrequenz rate "
    "fsamp fsample samplefreq samplingfreq samprate sampfreq samplespersecond sps scanrate scanfrequency "
    "fa fe srate acquisitionrate acquisitionfrequency datarate frequencedechantillonnage "
    "frequenceechantillonnage частотадискретизации частотаопроса 采样率 采样频率",
    "trigger": "triggersample triggerindex triggerposition pretriggersamples pretriggerpoints "
    "pretrigsamples pretrigpoints presamples prepoints triggerpoint triggerpos trigpos trigsample "
    "trigindex trigpoint triggerlocation triggersampleindex triggerlage triggerpunkt pointdedeclenchement",
    "before": "pretrigger pretriggertime pretrig pretrigtime pretriggerduration vorlauf vorlaufzeit "
    "timebeforetrigger predeclenchement",
    "start": "t0 tstart x0 xorg xorigin xoffset xstart xzero tzero hoffset wfstartoffset startoffset "
    "timeoffset horizontaloffset horizoffset firstsample firsttime begintime tbegin begin starttime start",
    "first": "startsample firstsampleindex startindex",
    "unsure": "delay triggerdelay horizontaldelay timedelay posttrigger posttriggersamples",
    "count": "samples samplecount numberofsamples numsamples nsamples points numberofpoints recordlength "
    "blocksize anzahlwerte anzahlmesswerte anzahlabtastwerte messwerte",
    "time unit": "xunit xunits xaxisunit hunit horizontalunit horizontalunits horzunits horizunits "
    "isiunits timeunit timeunits dtunit dtunits",
    "names": "label title name names tracename channelname signalname pointname kanalname messstelle tag "
    "tagname bezeichnung signal channellabel signalbezeichnung trace sensorname chname",
    "comment": "comment comments kommentar kommentare bemerkung",
    "units": "unit units einheit einheiten yunit yunits yunitlabel yaxisunit vunit verticalunit vertunits "
    "verticalunits unitstring niunitdescription engunits engineeringunit channelunit unitlabel "
    "physicalunit unite ydimension displacementunit lengthunit единицы",
    "factor": "scale scalefactor",
    "per count": "factor faktor yinc yincrement gain slope conversionfactor calibrationfactor lsb "
    "resolution multiplier scaling unitspercount valuepercount",
    "offset": "yorg yorigin addoffset offset intercept zerooffset",
    "none": "fillvalue missingvalue nodata nodatavalue novalue invalidvalue",
    "speed": "speed rpm rotorspeed shaftspeed machinespeed rotationalspeed rotationspeed nominalspeed omega "
    "runningspeed operatingspeed samplespeed speedofrotation drehzahl nenndrehzahl rotordrehzahl "
    "betriebsdrehzahl vitesse vitessederotation частотавращения 转速",
}
_KINDS = {key: kind for kind, keys in _KEYS.items() for key in keys.split()}
"""Keys in letters and digits only; of several starts the one that stands first here counts."""

_CLOCK = ("step", "rate", "trigger", "before", "start", "first", "unsure")
_SHORT, _FINAL = 6, ("fs", "ts", "dt")
"""Kinds of a clock; letters that a key of it has behind other words, or which it is then (chosen)."""

SAME_SPEED, NO_SHAFT = 0.01, 3e4
"""Share by which the speeds of a head may differ and be one [1], and what no shaft has [rad/s] (chosen)."""

_NUMBER = re.compile(r"\s*([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eEdD][+-]?\d+)?)\s*([^\s;)]*(?: ?min)?)")
_SAMPLES = re.compile(r"\d{3,15}|\d+ ?(?:samples?|points?|pts)", re.IGNORECASE)
_PER_SECOND = re.compile(
    r"(?i)([kmg]?)(?:s|sa|samp|samples?|pts|points|1|hz)?(?:(?:/|\s?per\s?)s(?:ec|econd)?|ps)"
)
_THOUSANDS = re.compile(r"\s*\d{1,3}[.,]\d{3}\s*(?!\d|[Hh]z)")
"""What may be thousands or decimals, "6.600 rpm"."""
_A_DATE = re.compile(r"\d[:/]\d|\d[-.]\d+[-.]\d|\d ?[A-Za-z]{3,}\.? \d")


@dataclass(frozen=True, kw_only=True)
class Told:
    """The clock that entries give; None where they do not."""

    step: float | None
    start: float | None
    """Time between samples, and of the first one [s]."""
    sample: float | None
    """Number of the sample at which the record time is zero."""
    share: float | None
    """The same as a share of the record [1]."""
    time_unit: str
    """Unit of the time axis."""
    unused: tuple[str, ...]
    """Entries of a clock that are not understood, or contradict those that are."""

    def begin(self, count: int, step: float) -> float | None:
        """Time of the first of a number of samples [s]."""
        sample = round(self.share * count) if self.sample is None and self.share is not None else self.sample
        return self.start if sample is None else -sample * step


def kind_of(key: str) -> str:
    """What a key tells, by its letters and digits without a unit; empty for one that is not known."""
    return _KINDS.get(_word(key), "")


def _word(key: str) -> str:
    """The known word of a key, which in a key of a clock may stand behind others: "nominal sampling rate"."""
    name = split_unit(key.rstrip(" :"))[0]
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", name.lower()) if sign.isalnum())
    behind = [plain[k:] for k in range(1, len(plain) - _SHORT + 1)]
    behind += [word for word in name.lower().split()[1:][-1:] if word in _FINAL]
    # "Time 1 - default sample rate" is the name of a column
    behind = [word for word in behind if _KINDS.get(word) in _CLOCK[:3] and not TIME_NAMES.match(name)]
    return next((word for word in (plain, plain.removesuffix("s"), *behind) if word in _KINDS), "")


def clock_told(entries: Mapping[str, Any], unit: str = "") -> Told:
    """The clock by keys and values, numbers or texts; its unit in the value, the key, beside it, or s."""
    found = {
        kind: [(k, v) for k, v in entries.items() if kind_of(k) == kind] for kind in (*_CLOCK, "time unit")
    }
    units = (known_unit(str(value).partition(" ")[0]) for _, value in found["time unit"])
    time_unit = next(filter(None, units), unit)
    found["start"].sort(key=lambda one: list(_KINDS).index(_word(one[0])))
    steps = dict(_quantities(found["step"], "time", time_unit))
    rates = dict(_quantities(found["rate"], "frequency", "Hz"))
    starts = dict(_quantities(found["start"], "time", time_unit))
    step = next((one for one in steps.values() if one > 0.0), None)
    step = next((1.0 / one for one in rates.values() if one > 0.0), None) if step is None else step
    start = next(iter(starts.values()), None)
    sample = share = None
    read = {*steps, *rates, *(key for key, own in starts.items() if own in (start, 0.0))}
    for key, value in [*found["trigger"], *found["before"], *found["first"]]:
        kind, match = kind_of(key), _number_in(value)
        if match is None:
            continue
        number, own = float(match[1].replace(",", ".")), known_unit(match[2]) or split_unit(key)[2]
        timed = own or (time_unit if kind != "trigger" else "")
        if match[2][:1] == "%" or own == "%":
            share = number / 100.0
        elif kind == "first":  # in the unit of the step, which is said for both
            start = dict(_quantities([(key, value)], "time", time_unit)).get(key) if time_unit else start
            sample = sample if time_unit else -number
        elif timed or (kind == "before" and not _SAMPLES.fullmatch(str(value).strip())):
            before = dict(_quantities([(key, value)], "time", time_unit)).get(key)
            start = -abs(before) if start is None and before is not None else start
        elif number == round(number):
            sample = number if kind == "trigger" else abs(number)
        else:
            continue
        read.add(key)
    said = [(k, v) for kind in _CLOCK for k, v in found[kind] if k not in read and _number_in(v)]
    return Told(
        step=step,
        start=start,
        sample=sample,
        share=share,
        time_unit=time_unit,
        unused=tuple(f"{key} = {value!s:.40}" for key, value in said if re.search("[1-9]", str(value))),
    )


def speed_told(entries: Mapping[str, Any]) -> tuple[float | None, str]:
    """The one speed [rad/s] that entries of a head give, and words on it or on what is not used."""
    last = {key: kind_of(key) or kind_of(re.split("[./]", key)[-1]) for key in entries}
    said = [(k, v) for k, v in entries.items() if last[k] == "speed" and _number_in(v)]
    sure = _quantities([(k, v) for k, v in said if not _THOUSANDS.match(str(v))], "speed", "?")
    found = [value for _, value in sure if abs(value) < NO_SHAFT]
    told = ", ".join(f"{key} = {value!s:.40}" for key, value in said)
    if found and max(found) - min(found) <= SAME_SPEED * abs(found[0]):
        return found[0], f"speed of the head of the file: {told}"
    return None, f"not used, the head of the file has no one speed with a unit: {told}" if told else ""


def _number_in(value: Any) -> re.Match[str] | None:
    """The number that a value begins with and its unit; None for lists, dates and words."""
    return None if isinstance(value, list) or _A_DATE.search(str(value)) else _NUMBER.match(str(value))


def _quantities(found: list[tuple[str, Any]], kind: str, unit: str) -> Iterator[tuple[str, float]]:
    """Keys and numbers in SI units of those entries that are quantities of a kind."""
    for key, value in found:
        match = _number_in(value)
        if match is None:
            continue
        own = known_unit(match[2]) or split_unit(key)[2] or match[2] or unit or "s"
        per_second = _PER_SECOND.fullmatch(own) if kind == "frequency" else None
        own = f"{per_second[1].replace('m', 'M')}Hz" if per_second else known_unit(own) or own
        try:
            number = re.sub("[dD]", "e", match[1].replace(",", "."))
            yield key, parse_quantity(f"{number} {own}", kind)
        except UsageError:
            continue
