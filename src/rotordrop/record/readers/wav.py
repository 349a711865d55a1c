"""WAV: sound files, which many recorders write; full scale is 1 until a profile says what it is worth."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.recording import FULL_SCALE, Recording, channels_in_words, damaged
from rotordrop.units import split_quantity

_PCM, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
"""Codes of the formats of samples, by the definition of WAV; the last says its code further on."""


def read_wav(path: Path, profile: Profile) -> Recording:
    """Read integers of 8, 16, 24 or 32 bits or floating-point samples.

    ``text.names`` of the profile names the channels (else ``channel 1``, …), ``full_scale`` says what 1 is.
    """
    content = path.read_bytes()
    blocks = _blocks(content, path)
    if b"fmt " not in blocks or b"data" not in blocks or len(blocks[b"fmt "]) < 16:
        raise damaged(path, " has no format or no samples")
    kind, count, rate, _, align, bits = struct.unpack_from("<HHIIHH", blocks[b"fmt "])
    if kind == _EXTENSIBLE and len(blocks[b"fmt "]) >= 26:
        kind = struct.unpack_from("<H", blocks[b"fmt "], 24)[0]
    data = blocks[b"data"]
    if not count or not rate or align * 8 != count * bits or len(data) % align:
        words = f"{len(data)} bytes of samples do not divide into {channels_in_words(count)} of {bits} bits"
        raise damaged(path, f": {words}")
    samples = _samples(data, kind, bits, path).reshape(-1, count)
    factor, unit = (1.0, FULL_SCALE) if profile.full_scale is None else split_quantity(profile.full_scale)
    names = profile.text.names or tuple(f"channel {number + 1}" for number in range(count))
    if len(names) != count:
        raise RecordError(f"{path} has {channels_in_words(count)} and the profile names {len(names)}")
    time = np.arange(len(samples), dtype=np.float64) / rate
    if unit == FULL_SCALE:  # shares have no unit, whatever the profile calls them
        profile = profile.model_copy(update={"units": {}})
    channels = tuple(
        profile.channel(name, unit, samples[:, i] * factor, time) for i, name in enumerate(names)
    )
    return Recording(channels=channels, notes=("no trigger in the file: record time counts from the start",))


def _blocks(content: bytes, path: Path) -> dict[bytes, bytes]:
    """Walk the blocks, comparing what each declares with what is there."""
    if content[:4] != b"RIFF" or content[8:12] != b"WAVE":
        raise RecordError(f"{path} does not begin with RIFF and WAVE; it is no WAV file")
    found: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(content):
        name, length = struct.unpack_from("<4sI", content, at)
        if at + 8 + length > len(content):
            words = f"declares {length} bytes and {len(content) - at - 8} are present"
            raise damaged(path, f" is truncated: the block {name.decode('latin-1')!r} {words}")
        found.setdefault(name, content[at + 8 : at + 8 + length])
        at += 8 + length + length % 2
    declared = struct.unpack_from("<I", content, 4)[0] + 8
    if declared > len(content) + 1:
        raise damaged(path, f" is truncated: it declares {declared} bytes and has {len(content)}")
    return found


def _samples(data: bytes, kind: int, bits: int, path: Path) -> Array:
    if kind == _FLOAT and bits in (32, 64):
        return np.frombuffer(data, f"<f{bits // 8}").astype(np.float64)
    if kind != _PCM or bits not in (8, 16, 24, 32):
        words = f"WAV format {kind} with {bits} bits is not known"
        raise RecordError(f"{path}: {words}; export plain PCM or float")
    if bits == 8:
        return (np.frombuffer(data, np.uint8).astype(np.float64) - 128.0) / 128.0
    if bits == 24:
        wide = np.zeros((len(data) // 3, 4), dtype=np.uint8)
        wide[:, 1:] = np.frombuffer(data, np.uint8).reshape(-1, 3)
        return wide.view("<i4")[:, 0] / 2.0**31
    return np.frombuffer(data, f"<i{bits // 8}") / 2.0 ** (bits - 1)
