# SPDX-License-Identifier: MIT
"""On the box: takes retained signed files, and gives compboxd those that are in order."""

import json
import pathlib
import sys
import tempfile
import time

from . import signing, tools
from .errors import FleetError
from .links import NOT_OF_A_BOX
from .registry import read_bytes, read_json, write_file


def take(payload, keys, place):
    """Checks a payload and puts its file to `place`. in: bytes of links.payload_of(); folder of
    public keys; path of the running file. out: the new revision, or None for the file that runs already.
    Throws FleetError for what is refused; nothing changes then."""
    place = pathlib.Path(place)
    try:
        message = json.loads(payload)
        text, signature = message["file"], message["signature"]
        verify(text, signature, keys)
        made, runs = json.loads(text), read_json(place)
    except NOT_OF_A_BOX as error:
        raise FleetError("refused: the message has no file and signature") from error
    if made["machine"]["name"] != runs["machine"]["name"]:
        raise FleetError(f"refused: the file is of {made['machine']['name']}, not of {runs['machine']['name']}")
    if made["revision"] < runs["revision"]:
        raise FleetError(f"refused: revision {made['revision']} is older than the running {runs['revision']}")
    if made["revision"] == runs["revision"]:
        if text.encode() != read_bytes(place):
            raise FleetError(f"refused: another file of the running revision {runs['revision']}")
        if pathlib.Path(f"{place}.minisig.new").exists():  # put() was cut off: the next one overwrites it
            write_file(pathlib.Path(f"{place}.minisig"), signature.encode())
        return None
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "coefficients.json").write_text(text, encoding="utf-8")
        tools.compbox("check", "coefficients.json", folder=folder)
    put(text, signature, place)
    return made["revision"]


def verify(text, signature, keys):
    """Throws FleetError unless a key of the folder has signed the file."""
    try:
        signing.verify(text, signature, keys)
    except FleetError as error:
        raise FleetError(f"refused: {str(error).removeprefix('compbox verify: ')}") from error


def put(text, signature, place):
    """Replaces a file and its signature. At every moment the signature of the file that is there is in PLACE.minisig or
    PLACE.minisig.new, so a box that starts in between, or after a power cut, finds it."""
    new = pathlib.Path(f"{place}.minisig.new")
    write_file(new, signature.encode())
    write_file(place, text.encode())
    new.replace(f"{place}.minisig")


def reported(payload, keys, place):
    """take(), with one line on stderr about what it did."""
    try:
        revision = take(payload, keys, place)
        if revision is not None:
            print(f"compbox: {place}: took revision {revision}", file=sys.stderr, flush=True)
    except FleetError as error:
        print(f"compbox: {place}: {error}", file=sys.stderr, flush=True)


def from_folder(folder, keys, place, once):
    """Follows DIR/file.json, also across an absence of a share, or on a stick whose times have two seconds."""
    path, last, said = pathlib.Path(folder) / "file.json", None, ""
    while True:
        content, trouble = None, ""
        try:
            now = path.stat().st_mtime_ns, path.stat().st_size
            if now != last:
                content, last = path.read_bytes(), now
        except FileNotFoundError:
            pass
        except OSError as error:
            if once:
                raise
            trouble = f"compbox: {path}: {error.strerror}"
        if trouble not in ("", said):
            print(trouble, file=sys.stderr, flush=True)
        said = trouble
        if content is not None:
            reported(content, keys, place)
        if once:
            return
        time.sleep(1)


def from_broker(link, keys, place):
    """in: links.Mqtt that follows the one topic of this machine. Does not return."""
    while True:
        for _, payload in link.received():
            reported(payload, keys, place)
