# SPDX-License-Identifier: MIT
"""A PLC whose frames are pymodbus': somebody else's codec, so that ours cannot agree with itself."""
import logging

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusSlaveContext
from pymodbus.factory import ServerDecoder
from pymodbus.transaction import ModbusSocketFramer

from raw_plc import RawPlc

logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class Block(ModbusSequentialDataBlock):
    """Registers that live in a Plc."""

    def __init__(self, plc):
        super().__init__(0, [0] * len(plc.registers))
        self.plc = plc

    def getValues(self, address, count=1):
        return self.plc.read(address, count)

    def setValues(self, address, values):
        self.plc.write(address, list(values))


class PymodbusPlc(RawPlc):
    def __init__(self, plc, port):
        super().__init__(plc, port)
        self._framer = ModbusSocketFramer(ServerDecoder())
        self._context = ModbusSlaveContext(hr=Block(plc), zero_mode=True)

    def reply(self, request):
        replies = []

        def execute(decoded):
            reply = decoded.execute(self._context)
            reply.transaction_id, reply.unit_id = decoded.transaction_id, decoded.unit_id
            replies.append(self._framer.buildPacket(reply))

        self._framer.processIncomingPacket(request.frame, execute, unit=[request.unit], single=True)
        return replies[0]
