# SPDX-License-Identifier: MIT
"""The clients of a box's page and metrics, and a stand-in that answers them as compbox-view does.

  plant_load.py clients PORT           until SIGTERM; then prints {"scrapes": …, "metrics": …, "messages": […]}
  plant_load.py capture PORT FILE      writes compbox-view's replies into FILE
  plant_load.py answer FILE            prints its port, and answers with the replies of FILE until SIGTERM"""
import asyncio
import json
import pathlib
import signal
import sys

SCRAPES_PER_S, READERS, MESSAGES_PER_S = 100, 10, 5


def asked(path):
    return f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode()


async def reply_of(port, path):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(asked(path))
    reply = await reader.read()
    writer.close()
    return reply


class Clients:
    """A scrape every 10 ms, each on a connection of its own, and readers of the stream."""

    def __init__(self, port):
        self.port, self.scrapes, self.metrics, self.messages = port, 0, 0, [0] * READERS

    async def scrape(self):
        reply = await reply_of(self.port, "/metrics")
        self.scrapes += b" 200 " in reply
        self.metrics += b"\ncompbox_up 1\n" in reply

    async def scrape_on(self):
        clock, due, pending = asyncio.get_running_loop().time, None, set()
        while True:
            due = (due or clock()) + 1 / SCRAPES_PER_S
            await asyncio.sleep(due - clock())
            pending.add(task := asyncio.create_task(self.scrape()))
            task.add_done_callback(pending.discard)

    async def read_on(self, number):
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        writer.write(asked("/api/stream"))
        while line := await reader.readline():
            self.messages[number] += line.startswith(b"data: ")

    async def run(self, stop):
        tasks = [asyncio.create_task(self.scrape_on())]
        tasks += [asyncio.create_task(self.read_on(number)) for number in range(READERS)]
        await stop.wait()
        for task in tasks:
            task.cancel()
        print(json.dumps({"scrapes": self.scrapes, "metrics": self.metrics, "messages": self.messages}))


async def capture(port, file):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(asked("/api/stream"))
    head = await reader.readuntil(b"\r\n\r\n")
    message = b""
    while b'"stale":false' not in message:
        message = await reader.readuntil(b"\n\n")
    metrics = await reply_of(port, "/metrics")
    file.write_text(json.dumps([part.decode() for part in (metrics, head, message)]))


async def answer(file, stop):
    metrics, head, message = (part.encode() for part in json.loads(file.read_text()))

    async def serve(reader, writer):
        try:
            if b"/metrics" in await reader.readuntil(b"\r\n\r\n"):
                writer.write(metrics)
                await writer.drain()
                return
            writer.write(head)
            while True:
                writer.write(message)
                await writer.drain()
                await asyncio.sleep(1 / MESSAGES_PER_S)
        except (OSError, asyncio.IncompleteReadError, asyncio.CancelledError):
            pass  # the client has gone, or this program ends
        finally:
            writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await stop.wait()


async def main(what, *arguments):
    stop = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, stop.set)
    if what == "clients":
        await Clients(int(arguments[0])).run(stop)
    elif what == "capture":
        await capture(int(arguments[0]), pathlib.Path(arguments[1]))
    else:
        await answer(pathlib.Path(arguments[0]), stop)


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
