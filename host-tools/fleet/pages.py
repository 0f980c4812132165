# SPDX-License-Identifier: MIT
"""Serves the page of a site, and hands its questions to the time-series database. It keeps what an alert manager would
get. It listens on 127.0.0.1 alone, for a browser of this computer."""

import http.client
import http.server
import json
import pathlib
import threading
import urllib.error
import urllib.request

PAGE = pathlib.Path(__file__).resolve().parent / "site_page.html.in"
QUESTIONS = ("/api/v1/query?", "/api/v1/query_range?")
MOST_BYTES = 1_000_000  # of alerts in one message


class Handler(http.server.BaseHTTPRequestHandler):
    """GET / the page, /alerts what fires, /api/v1/query… from the database; POST /api/v2/alerts from vmalert."""

    def do_GET(self):
        host = self.headers.get("Host", "").rsplit(":", 1)[0]
        if host not in ("127.0.0.1", "localhost"):  # no page of another site reads this by a name of its own
            self.answer(403, "text/plain", b"ask 127.0.0.1\n")
        elif self.path == "/":
            self.answer(200, "text/html; charset=utf-8", PAGE.read_bytes())
        elif self.path == "/alerts":
            self.answer(200, "application/json", json.dumps(list(self.server.alerts.values())).encode())
        elif self.path.startswith(QUESTIONS):
            self.ask()
        else:
            self.answer(404, "text/plain", b"not here\n")

    def ask(self):
        try:
            with urllib.request.urlopen(self.server.database + self.path, timeout=30) as reply:
                self.answer(200, "application/json", reply.read())
        except urllib.error.HTTPError as error:
            self.answer(error.code, "application/json", error.read())
        except (OSError, http.client.HTTPException):
            self.answer(502, "text/plain", b"the database does not answer\n")

    def do_POST(self):
        length = int(self.headers.get("Content-Length", 0))
        if self.path != "/api/v2/alerts" or length > MOST_BYTES:
            self.answer(404, "text/plain", b"not here\n")
            return
        try:
            for alert in json.loads(self.rfile.read(length)):
                self.server.alerts[json.dumps(alert["labels"], sort_keys=True)] = alert
        except (ValueError, KeyError, TypeError):
            self.answer(400, "text/plain", b"no alerts\n")
            return
        self.answer(200, "application/json", b"{}")

    def answer(self, code, kind, body):
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


class Server:
    """in: address of the database; a port, 0 for any"""

    def __init__(self, database, port=0):
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self.server.daemon_threads = True
        self.server.database, self.server.alerts = database, {}
        self.address = f"http://127.0.0.1:{self.server.server_address[1]}"
        self.thread = threading.Thread(target=self.server.serve_forever)
        self.thread.start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()
