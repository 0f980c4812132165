// SPDX-License-Identifier: MIT
#include "tests/world/state_file.h"

#include <cstring>

namespace compbox::world {

namespace {

// CRC-32 of IEEE 802.3, bit by bit.
std::uint32_t crc_of(const std::string &bytes, std::size_t count) {
    std::uint32_t crc = ~0u;
    for (std::size_t i = 0; i < count; ++i) {
        crc ^= static_cast<unsigned char>(bytes[i]);
        for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
    }
    return ~crc;
}

}  // namespace

std::optional<state_file> decoded(const std::string &bytes) {
    state_file file;
    state_file::header head;
    if (bytes.size() < sizeof head + sizeof file.end + 4) return std::nullopt;
    std::memcpy(&head, bytes.data(), sizeof head);
    constexpr std::uint32_t most = 64 + 256, most_probes = 8;  // lags of signals, lags of banks
    const bool known = head.format == (head.probes > 0 ? 4u : 3u);
    if (!known || head.count > most || head.probes > most_probes) return std::nullopt;
    const std::size_t body = sizeof head + head.count * sizeof(state_file::record) +
                             head.probes * sizeof(state_file::probe) + sizeof file.end;
    if (bytes.size() != body + 4) return std::nullopt;
    std::uint32_t sum = 0;
    std::memcpy(&sum, bytes.data() + body, sizeof sum);
    if (crc_of(bytes, body) != sum) return std::nullopt;
    file.synchronised = head.synchronised == 1;
    file.records.resize(head.count);
    if (head.count > 0)
        std::memcpy(file.records.data(), bytes.data() + sizeof head,
                    head.count * sizeof(state_file::record));
    std::memcpy(&file.end, bytes.data() + body - sizeof file.end, sizeof file.end);
    return file;
}

}  // namespace compbox::world
