# SPDX-License-Identifier: MIT
"""compbox keygen, sign and verify; Debian's minisign as the peer in both directions."""

import json
import shutil
import stat
import subprocess

import pytest

from conftest import ROOT

EXAMPLE = ROOT / "examples/dual-drive/coefficients.json"


def minisign(folder, *arguments):
    return subprocess.run(["minisign", *arguments], cwd=folder, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL)


@pytest.fixture
def plant(compbox):
    """A folder with a coefficient file, plant.key, and plant.pub in the folder keys."""
    shutil.copy(EXAMPLE, compbox.folder / "c.json")
    compbox.good("keygen", "plant")
    (compbox.folder / "keys").mkdir()
    shutil.copy(compbox.folder / "plant.pub", compbox.folder / "keys")
    return compbox


def trusted_comment(compbox):
    return (compbox.folder / "c.json.minisig").read_text().splitlines()[2]


def test_a_signed_file_verifies(plant):
    out = plant.good("sign", "c.json", "--key", "plant.key")
    assert out.startswith("machine:dual-drive XY table revision:1 by key ") and out.endswith(": c.json.minisig\n")
    assert trusted_comment(plant) == "trusted comment: machine:dual-drive XY table revision:1"
    assert plant.good("verify", "c.json", "--keys", "keys") == "c.json: signed by keys/plant.pub\n"
    signed = plant.files()
    plant.good("sign", "c.json", "--key", "plant.key")
    assert plant.files() == signed, "the same inputs give the same bytes"


def test_json_reports_key_machine_and_revision(plant):
    made = json.loads(plant.good("sign", "c.json", "--key", "plant.key", "-o", "s", "--json"))
    assert made["files"] == ["s"] and made["machine"] == "dual-drive XY table" and made["revision"] == 1
    assert made["key"] in (plant.folder / "plant.pub").read_text()
    plant.good("sign", "c.json", "--key", "plant.key")
    assert json.loads(plant.good("verify", "c.json", "--keys", "keys", "--json"))["key"] == "keys/plant.pub"
    again = json.loads(plant.good("keygen", "again", "--json"))
    assert again["files"] == ["again.key", "again.pub"] and again["key"] != made["key"]


def test_the_secret_key_is_for_its_owner_alone_and_never_written_over(plant):
    assert stat.S_IMODE((plant.folder / "plant.key").stat().st_mode) == 0o600
    assert stat.S_IMODE((plant.folder / "plant.pub").stat().st_mode) == 0o644
    assert plant.refused("keygen", "plant") == ("plant.key: exists, and a key is never written over; give another name")
    (plant.folder / "plant.key").rename(plant.folder / "kept")
    assert plant.refused("keygen", "plant").startswith("plant.pub: exists")


def test_minisign_verifies_what_compbox_signs(plant):
    plant.good("sign", "c.json", "--key", "plant.key")
    done = minisign(plant.folder, "-V", "-p", "plant.pub", "-m", "c.json")
    assert done.returncode == 0 and "Trusted comment: machine:dual-drive XY table revision:1" in done.stdout, done
    (plant.folder / "c.json").write_text((plant.folder / "c.json").read_text() + " ")
    assert minisign(plant.folder, "-V", "-p", "plant.pub", "-m", "c.json").returncode != 0


@pytest.mark.parametrize("kind", [[], ["-l"]])
def test_compbox_verifies_what_minisign_signs(plant, kind):
    minisign(plant.folder, "-G", "-W", "-p", "keys/foreign.pub", "-s", "foreign.key")
    assert minisign(plant.folder, "-S", "-s", "foreign.key", "-m", "c.json", *kind).returncode == 0
    assert plant.good("verify", "c.json", "--keys", "keys") == "c.json: signed by keys/foreign.pub\n"
    (plant.folder / "c.json").write_text((plant.folder / "c.json").read_text() + " ")
    assert plant.refused("verify", "c.json", "--keys", "keys").startswith("c.json: is not what was signed")


def test_either_program_signs_with_the_others_key(plant):
    assert minisign(plant.folder, "-S", "-s", "plant.key", "-m", "c.json").returncode == 0
    assert plant.good("verify", "c.json", "--keys", "keys") == "c.json: signed by keys/plant.pub\n"
    minisign(plant.folder, "-G", "-W", "-p", "foreign.pub", "-s", "foreign.key")
    plant.good("sign", "c.json", "--key", "foreign.key")
    assert minisign(plant.folder, "-V", "-p", "foreign.pub", "-m", "c.json").returncode == 0
    assert plant.refused("verify", "c.json", "--keys", "keys").startswith("c.json: no key in keys has signed it")


def test_only_a_good_coefficient_file_is_signed(plant):
    plant.write("bad.json", {"format": "compbox/1"})
    assert plant.refused("sign", "bad.json", "--key", "plant.key").startswith("bad.json: ")
    assert plant.refused("sign", "c.json", "--key", "plant.pub") == (
        "plant.pub: is not a secret key; compbox keygen makes one")
    assert plant.refused("sign", "c.json", "--key", "none.key").startswith("none.key: cannot open the file")


def test_a_name_that_is_no_line_is_signed_as_one(plant):
    file = plant.read("c.json")
    file["machine"]["name"] = "läthe\u00a03 \\"
    plant.write("c.json", file)
    plant.good("sign", "c.json", "--key", "plant.key")
    plant.good("verify", "c.json", "--keys", "keys")
    assert minisign(plant.folder, "-V", "-p", "plant.pub", "-m", "c.json").returncode == 0


def test_a_folder_without_keys_verifies_nothing(plant):
    plant.good("sign", "c.json", "--key", "plant.key")
    (plant.folder / "empty").mkdir()
    assert plant.refused("verify", "c.json", "--keys", "empty") == (
        "empty: has no key NAME.pub to verify the signature with")
    assert plant.refused("verify", "c.json", "--keys", "none").startswith("none: cannot be read: No such file")
