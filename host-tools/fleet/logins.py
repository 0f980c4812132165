# SPDX-License-Identifier: MIT
"""The logins of a broker with TLS on this computer, and connections by them."""

import getpass
import secrets
import subprocess

from . import links
from .errors import FleetError
from .processes import program_of
from .registry import write_file


class Logins:
    """in: a folder, the boxes' names, the broker's port. write() leaves mosquitto.conf there and what it names: a
    certificate for 127.0.0.1 with its authority, a login for each box and for the site, and the rules by which a box
    sees its own topics alone."""

    def __init__(self, folder, names, port):
        self.folder, self.port = folder, port
        self.passwords = {name: secrets.token_urlsafe(16) for name in ("site", *names)}

    def write(self):
        self.certify()
        self.secret("users", "".join(f"{name}:{word}\n" for name, word in self.passwords.items()))
        self.tool("mosquitto_passwd", "mosquitto", "-U", "users")
        for name, word in self.passwords.items():
            self.secret(f"{name}.password", word + "\n")
        self.secret("acl", "pattern readwrite compbox/%u/#\nuser site\ntopic readwrite compbox/#\n")
        lines = [f"listener {self.port} 127.0.0.1", "allow_anonymous false", f"user {getpass.getuser()}",
                 *(f"{key} {self.folder / name}" for key, name in (
                     ("password_file", "users"), ("acl_file", "acl"), ("cafile", "ca.pem"), ("certfile", "broker.pem"),
                     ("keyfile", "broker.key")))]
        (self.folder / "mosquitto.conf").write_text("\n".join(lines) + "\n")

    def certify(self):
        def openssl(*words):
            self.tool("openssl", "openssl", *words)
        openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "ca.key", "-out", "ca.pem", "-days", "30",
                "-subj", "/CN=compbox demo")
        openssl("req", "-newkey", "rsa:2048", "-nodes", "-keyout", "broker.key", "-out", "broker.csr", "-subj",
                "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1")
        openssl("x509", "-req", "-in", "broker.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-out",
                "broker.pem", "-days", "30", "-copy_extensions", "copy")

    def tool(self, program, package, *words):
        done = subprocess.run([program_of(program, package), *words], cwd=self.folder, capture_output=True, text=True)
        if done.returncode:
            raise FleetError(f"{program}: {done.stderr.strip().splitlines()[-1]}")

    def secret(self, name, text):
        write_file(self.folder / name, text.encode())
        (self.folder / name).chmod(0o600)

    def link(self, name, follow=()):
        return links.Mqtt(f"127.0.0.1:{self.port}", "compbox", 0.2, (name, self.passwords[name]),
                          self.folder / "ca.pem", follow)
