"""Archives that are handed in: unpacked entry by entry, within bounds, and nowhere but below one folder."""

from __future__ import annotations

import lzma
import os
import re
import stat
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rigidcli.errors import printable, shortened

ENDING = ".zip"
"""The ending of archives, in small letters."""

MOST_FOLDERS = 9
"""Parts of a name in an archive: a download has two or three, and a student may add some."""

ELSEWHERE = frozenset("/\\:\0")
"""Characters by which a name leads out of its folder, on one system or another."""

HIDDEN = (".", "__MACOSX", "Thumbs.db", "desktop.ini")
"""Beginnings of names that are passed over without a word: some systems put such files beside others."""

_UTF8 = 0x800
"""The flag of an entry of an archive whose name is in UTF-8."""

_DEVICE = re.compile(r"(?i:con|prn|aux|nul|com[0-9]|lpt[0-9])(?:\..*)?")
"""Names that are devices on Windows, with any ending."""

BROKEN = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, OSError, RuntimeError, ValueError, EOFError)
"""What is raised for an archive, or for an entry, that is broken, encrypted, or of an unknown form."""


class Room(NamedTuple):
    """How much of an archive is unpacked: `files`, all their bytes, and those of one, which is cut off there.

    Of an archive within, as many bytes are kept as of all files: half of one is none.
    """

    files: int
    bytes: int
    each: int


def size(path: Path) -> int:
    """The bytes that an archive says it will become. Raises one of BROKEN."""
    with zipfile.ZipFile(path) as archive:
        return sum(info.file_size for info in archive.infolist())


def unpack(path: Path, folder: Path, room: Room, is_kept: frozenset[str]) -> Iterator[str]:
    """Unpack an archive into a folder. Yields a message for each entry that is left out by itself.

    Where a file and a folder have one name, the file stays if its ending `is_kept`, or else the folder.
    Raises one of BROKEN for what is no archive.
    """
    left = room.bytes
    folder.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path) as archive:
        named = [(_parts_of(info), info) for info in archive.infolist() if not info.is_dir()]
        named = [(parts, info) for parts, info in named if not any(each.startswith(HIDDEN) for each in parts)]
        answers = {parts for parts, _ in named if parts and Path(parts[-1]).suffix.lower() in is_kept}
        folders = {above for parts, _ in named for above in _above(parts) if above not in answers}
        # The smallest come first, so that no large one takes the room of others.
        named.sort(key=lambda each: each[1].file_size)
        for number, (parts, info) in enumerate(named):
            if number >= room.files or left <= 0:
                yield f"{len(named) - number:,} files are left out: the archive is too large"
                return
            try:
                if parts in folders or not answers.isdisjoint(_above(parts)):
                    raise ValueError("a file and a folder have one name")
                most = room.bytes if parts[-1:] and parts[-1].lower().endswith(ENDING) else room.each
                left -= _unpack(archive, info, folder.joinpath(*_harmless(parts, info)), min(most, left))
            except BROKEN as error:
                reason = "it is encrypted" if info.flag_bits & 1 else "it is broken, or its form is unknown"
                if isinstance(error, OSError | ValueError):
                    reason = getattr(error, "strerror", None) or str(error)
                yield f"`{shortened(printable('/'.join(parts)))}` is left out: {reason}"


def _parts_of(info: zipfile.ZipInfo) -> tuple[str, ...]:
    """The folders and the name of an entry; some programs write UTF-8 without saying so."""
    name = info.filename
    if not info.flag_bits & _UTF8:
        with suppress(UnicodeError):
            name = name.encode("cp437").decode()
    return tuple(part for part in re.split(r"[/\\]", name) if part not in ("", "."))


def _above(parts: tuple[str, ...]) -> list[tuple[str, ...]]:
    """The folders above an entry."""
    return [parts[:depth] for depth in range(1, len(parts))]


def _harmless(parts: tuple[str, ...], info: zipfile.ZipInfo) -> tuple[str, ...]:
    """The parts of a name below which an entry may be written. Raises ValueError for other entries."""
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG):
        raise ValueError("it is a link, or no file")
    if not parts or ".." in parts or ELSEWHERE & set("".join(parts)) or info.filename.startswith(("/", "\\")):
        raise ValueError("its name leads out of the folder")
    if os.name == "nt" and any(map(_DEVICE.fullmatch, parts)):
        raise ValueError("its name is that of a device")
    if len(parts) > MOST_FOLDERS:
        raise ValueError("it lies too deep")
    return parts


def _unpack(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: Path, most: int) -> int:
    """Write an entry of an archive into a file that is not there yet, and return how long it is."""
    with archive.open(info) as packed:
        data = packed.read(most)
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("xb") as target:
        target.write(data)
    return len(data)
