"""Recordings packed by gzip: unpacked within bounds, then read by the reader of what is inside."""

from __future__ import annotations

import gzip
import tempfile
import zlib
from pathlib import Path

from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile
from rotordrop.record.recording import Recording
from rotordrop.record.unpacking import refuse_bomb

_BLOCK = 2**20

_UNPACKED = 32 * 2**20
"""Bytes that any packed file may hold, and …"""

_UNPACKED_PER_BYTE = 16
"""… this many times its own: noisy readings pack three to six times, and a text takes eight times its bytes
to be read."""


def read_gzip(path: Path, profile: Profile) -> Recording:
    """Read ``drop.csv.gz`` and the like.

    Raises
    ------
    RecordError
        When the file is cut off or its checksum does not fit, or unpacks to far more than a recording.
    """
    from rotordrop.record.readers import read_recording

    with tempfile.TemporaryDirectory() as folder:
        inside = Path(folder) / path.stem
        _unpack(path, inside)
        try:
            return read_recording(inside, profile)
        except RecordError as error:
            raise RecordError(str(error).replace(str(inside), str(path))) from error


def _unpack(path: Path, inside: Path) -> None:
    size, written = path.stat().st_size, 0
    try:
        with gzip.open(path, "rb") as packed, inside.open("wb") as stream:
            while block := packed.read(_BLOCK):
                written += len(block)
                refuse_bomb(written // 8, size, path, most=_UNPACKED, most_per_byte=_UNPACKED_PER_BYTE)
                stream.write(block)
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise RecordError(f"{path} cannot be unpacked: {error}; copy it again") from error
