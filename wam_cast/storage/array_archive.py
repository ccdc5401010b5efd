"""Arrays in a compressed numpy archive that somebody else may have written or damaged."""

from __future__ import annotations

import io
import struct
import tokenize
import zipfile
import zlib
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

LARGEST_MEMBER = 10_000_000
"""Bytes that a file may have and a member of the archive may unpack to."""

NOT_AN_ARCHIVE = (
    ValueError,
    LookupError,
    OSError,
    EOFError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    tokenize.TokenError,
    SyntaxError,
    MemoryError,
)
"""What zip and numpy, and Python's parser for an array's header, raise for bytes that are something else, or damaged."""


def read_array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    """Return an array of an archive; raises one of `NOT_AN_ARCHIVE` if its checksum or anything else is wrong.

    By hand, since `np.load` makes room for whatever a file says that it holds, and reads past no array's end to its checksum.
    """
    member = archive.getinfo(f"{name}.npy")
    if member.file_size > LARGEST_MEMBER or member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError
    with archive.open(member) as file:
        content = file.read(LARGEST_MEMBER)
    stream = io.BytesIO(content)
    if npy.read_magic(stream) != (1, 0):
        raise ValueError
    shape, is_fortran, dtype = npy.read_array_header_1_0(stream)
    array = np.frombuffer(content, dtype, offset=stream.tell())  # refuses objects, which would be a pickle
    return array.reshape(shape, order="F" if is_fortran else "C").copy("K")
