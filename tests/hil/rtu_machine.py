# SPDX-License-Identifier: MIT
"""A machine with one axis whose PLC is on a serial line, and the frames there."""
import struct

LIMITS = {"limit_um": 300, "error_um": 400, "slew_um_per_s": 2000}


def coefficients(device):
    """The usual registers of fakeplc for X; EXX is 20 µm at 500 mm, so the box writes -20."""
    return {
        "format": "compbox/1", "revision": 1, "machine": {"name": "serial"}, "cycle": {"period_ms": 30},
        "plc": {"profile": "generic", "exchange": "fc3+fc16",
                "transport": {"rtu": {"device": device, "baud": 115200, "slave_delay_ms": 1}},
                "read": {"start": 0, "count": 26}, "write": {"start": 100, "count": 6},
                "control": 0, "plc_heartbeat": 1, "status": 100, "box_heartbeat": 101,
                "heartbeat_timeout_ms": 200},
        "signals": [{"name": "X", "unit": "mm", "plc": 8, "type": "int32", "scale": 0.0001,
                     "min": 0, "max": 1000}],
        "terms": [{"name": "EXX", "type": "polyline", "signal": "X", "positions": [0, 1000],
                   "values": [20, 20]}],
        "channels": [{"name": "X", "sum": ["EXX"], "plc": 104, "type": "int32", "scale": 0.00001,
                      "applied": 24, **LIMITS}],
        "safety": {"hold_ms": 1000, "ramp_um_per_s": 500},
    }


def with_crc(frame):
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return bytes(frame) + struct.pack("<H", crc)
