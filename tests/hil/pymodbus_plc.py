# SPDX-License-Identifier: MIT
"""A PLC served by pymodbus: somebody else's codec, so that ours cannot agree with itself."""
import asyncio
import logging
import threading

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server.async_io import ModbusTcpServer
from pymodbus.transaction import ModbusSocketFramer

from realtime import run_before_others

logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class Refused(Exception):
    """pymodbus answers with exception 4, device failure."""


class Block(ModbusSequentialDataBlock):
    """Registers that live in a Plc."""

    def __init__(self, plc):
        super().__init__(0, [0] * len(plc.registers))
        self.plc = plc

    def getValues(self, address, count=1):
        if self.plc.refuse_reads:
            raise Refused
        return self.plc.read(address, count)

    def setValues(self, address, values):
        if self.plc.refuse_writes:
            raise Refused
        self.plc.write(address, list(values))


class PymodbusPlc:
    """Serves `plc` on 127.0.0.1:port while the context is open."""

    def __init__(self, plc, port):
        self.plc, self.port = plc, port
        self.loop, self.server = None, None
        self.up = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)

    def _run(self):
        run_before_others()
        self.loop = asyncio.new_event_loop()
        asyncio.set_event_loop(self.loop)
        context = ModbusServerContext(ModbusSlaveContext(hr=Block(self.plc), zero_mode=True))
        self.server = ModbusTcpServer(context, ModbusSocketFramer, None, ("127.0.0.1", self.port),
                                      allow_reuse_address=True, loop=self.loop)

        async def serve():
            self.listening = asyncio.ensure_future(self.server.serve_forever())
            await self.server.serving
            self.up.set()

        self.loop.create_task(serve())
        self.loop.run_forever()

    def __enter__(self):
        self.thread.start()
        assert self.up.wait(60), "pymodbus does not come up"
        return self

    def __exit__(self, *_):
        """Dies as a PLC does that is switched off: connections are reset."""
        def stop():
            for handler in list(self.server.active_connections.values()):
                handler.transport.abort()
            self.server.server.close()
            self.listening.cancel()
            self.loop.call_later(0.05, self.loop.stop)

        self.loop.call_soon_threadsafe(stop)
        self.thread.join(60)
        self.loop.close()
