#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""LinuxCNC's user interface in the test: a line of Python on the socket `display.sock`, one answer line.
c is the command channel, s the status."""
import os
import socketserver

import linuxcnc

c, s = linuxcnc.command(), linuxcnc.stat()


class Handler(socketserver.StreamRequestHandler):
    def handle(self):
        for line in self.rfile:
            text = line.decode().strip()
            if text == "quit":
                os._exit(0)
            try:
                s.poll()
                answer = repr(eval(text, {"c": c, "s": s, "linuxcnc": linuxcnc}))
            except Exception as error:  # the test shows it
                answer = f"error: {error}"
            self.wfile.write((answer + "\n").encode())


socketserver.UnixStreamServer("display.sock", Handler).serve_forever()
