// SPDX-License-Identifier: MIT
// Any bytes, with any silences between them, as the reply to any request: what the receiver takes
// is what the decoder takes from an exact copy of the same bytes, and nothing is written beyond it.
// Input: function, unit, start, count, then pairs of (silence in 16 µs, byte).
#include <cstdio>
#include <cstdlib>
#include <vector>

extern "C" {
#include "firmware/wire/rtu_receiver.h"
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void demand(bool holds, const char *what) {
    if (holds) return;
    std::fprintf(stderr, "%s\n", what);
    std::abort();
}

static cb_modbus_request request_of(const uint8_t *data) {
    static const uint8_t functions[] = {CB_MODBUS_READ, CB_MODBUS_WRITE, CB_MODBUS_WRITE_READ};
    static const uint16_t zeros[123] = {};
    cb_modbus_request request{};
    request.function = functions[data[0] % 3];
    request.read_start = request.write_start = data[2];
    request.read_count = static_cast<uint16_t>(data[3] % 127);
    request.write_count = static_cast<uint16_t>(data[3] % 124);
    request.write_registers = zeros;
    return request;
}

static void check_taken(const cb_rtu_receiver &receiver, const cb_modbus_request &request) {
    std::vector<uint16_t> taken(request.read_count, 0xEEEE), again(taken);
    uint8_t exception = 0;
    const auto answer = cb_rtu_receiver_take(&receiver, taken.data(), &exception);
    const bool is_reply = receiver.state == CB_RTU_REPLY;
    demand(is_reply == (answer == CB_RTU_OK || answer == CB_RTU_EXCEPTION), "state and answer");
    if (!is_reply) return;
    const std::vector<uint8_t> frame(receiver.frame + receiver.from,
                                     receiver.frame + receiver.have);
    demand(cb_rtu_check(receiver.head[0], frame.data(), frame.size()) == CB_RTU_OK, "unit or CRC");
    demand(cb_rtu_decode_sound(&request, frame.data(), frame.size(), again.data(), &exception) ==
               answer,
           "the decoder says otherwise");
    demand(taken == again, "registers differ");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size < 4) return 0;
    const cb_modbus_request request = request_of(data);
    uint8_t sent[CB_RTU_MAX_FRAME];
    const size_t bytes = cb_rtu_encode(data[1], &request, sent);
    if (bytes == 0) return 0;
    demand(bytes == cb_rtu_request_bytes(&request), "length of the request");
    cb_rtu_receiver receiver;
    cb_rtu_receiver_start(&receiver, {750, 1750});
    int64_t now_us = 0;
    cb_rtu_receiver_expect(&receiver, data[1], &request, now_us);
    for (size_t i = 4; i + 1 < size; i += 2) {
        now_us += 16 * data[i];
        cb_rtu_receiver_byte(&receiver, data[i + 1], now_us);
        demand(receiver.from <= receiver.have && receiver.have <= sizeof receiver.frame, "bounds");
    }
    cb_rtu_receiver_look(&receiver, now_us + 10000);
    demand(receiver.state != CB_RTU_INSIDE, "silence ends everything");
    demand(!cb_rtu_receiver_damaged(&receiver) || receiver.state == CB_RTU_SPOILT,
           "damaged is spoilt");
    check_taken(receiver, request);
    return 0;
}
