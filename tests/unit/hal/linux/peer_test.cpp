// SPDX-License-Identifier: MIT
// Replies that do not match their request: under which kind each is counted, with what it has and
// what was expected.
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

extern "C" {
#include "hal/linux/peer.h"
}

namespace {

// out: what the peer's reply `pdu`, from unit 1, counts as
cb_odd_reply odd_of(const cb_modbus_request &request, std::vector<uint8_t> pdu, cb_odd kind) {
    cb_peer peer{};
    pdu.insert(pdu.begin(), 1);
    cb_peer_note_odd(&peer, 1, &request, pdu.data(), pdu.size());
    unsigned all = 0;
    for (const cb_odd_reply &one : peer.odd) all += one.count;
    EXPECT_EQ(all, 1u);
    return peer.odd[kind];
}

void expect_odd(const cb_odd_reply &odd, unsigned got, unsigned expected) {
    EXPECT_EQ(odd.count, 1u);
    EXPECT_EQ(odd.got, got);
    EXPECT_EQ(odd.expected, expected);
}

constexpr uint16_t block[2] = {1, 2};

TEST(peer, the_echo_of_a_write_has_another_start_or_number) {
    const cb_modbus_request write = cb_modbus_write(100, 2, block);
    expect_odd(odd_of(write, {16, 0, 101, 0, 2}, CB_ODD_ECHO), 101, 100);
    expect_odd(odd_of(write, {16, 0, 100, 0, 3}, CB_ODD_LENGTH), 6, 4);
}

TEST(peer, a_reply_to_a_write_that_is_too_short_or_too_long_is_counted_by_its_length) {
    const cb_modbus_request write = cb_modbus_write(100, 2, block);
    expect_odd(odd_of(write, {16, 0, 100}, CB_ODD_LENGTH), 3, 5);
    expect_odd(odd_of(write, {16, 0, 100, 0, 2, 9}, CB_ODD_LENGTH), 6, 5);
}

TEST(peer, a_reply_to_a_read_is_counted_by_its_length_or_its_number_of_bytes) {
    const cb_modbus_request read = cb_modbus_read(8, 2);
    expect_odd(odd_of(read, {3, 2, 0, 1}, CB_ODD_LENGTH), 4, 6);
    expect_odd(odd_of(read, {3, 6, 0, 1, 0, 2}, CB_ODD_LENGTH), 8, 6);
}

}  // namespace
