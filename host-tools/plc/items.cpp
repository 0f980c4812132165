// SPDX-License-Identifier: MIT
#include "host-tools/plc/items.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace compbox::plc {

namespace {

bool is_bit(const item &of) {
    return of.from == table::coil || of.from == table::discrete;
}

// The whole text as a number: decimal, or hexadecimal behind 0x.
std::optional<double> number_in(const std::string &text) {
    const bool hex = text.size() > 2 && (text.rfind("0x", 0) == 0 || text.rfind("0X", 0) == 0);
    const char *from = text.data() + (hex ? 2 : text.rfind('+', 0) == 0 ? 1 : 0);
    const char *end = text.data() + text.size();
    double value = 0.0;
    std::uint32_t bits = 0;
    const auto result =
        hex ? std::from_chars(from, end, bits, 16) : std::from_chars(from, end, value);
    if (result.ec != std::errc() || result.ptr != end || !std::isfinite(value)) return std::nullopt;
    return hex ? bits : value;
}

}  // namespace

std::string item::place() const {
    return name.empty() ? std::to_string(address) : fmt::format("{} ({})", address, name);
}

words_at read_items(client &from, const std::vector<item> &items) {
    std::vector<item> sorted = items;
    std::sort(sorted.begin(), sorted.end(),
              [](const item &a, const item &b) { return a.address < b.address; });
    words_at words;
    for (std::size_t first = 0, next = 0; first < sorted.size(); first = next) {
        const int start = sorted[first].address, block = sorted[first].block;
        int end = sorted[first].end();
        for (next = first + 1; next < sorted.size(); ++next) {
            const bool shared = block >= 0 && sorted[next].block == block;
            if (!shared && sorted[next].address > end) break;
            end = std::max(end, sorted[next].end());
        }
        const auto found = from.read(sorted[first].from, start, end - start);
        for (int i = 0; i < end - start; ++i) words[start + i] = found[static_cast<std::size_t>(i)];
    }
    return words;
}

std::vector<std::uint16_t> words_of(const item &of, const words_at &words) {
    std::vector<std::uint16_t> found;
    for (int address = of.address; address < of.end(); ++address) {
        found.push_back(words.at(address));
    }
    return found;
}

double value_of(const item &of, const words_at &words) {
    return of.format.decode(words_of(of, words).data()) * of.scale + of.zero;
}

std::string value_text(const item &of, const words_at &words) {
    return fmt::format("{:.10g}{}{}", value_of(of, words), of.unit.empty() ? "" : " ", of.unit);
}

std::string raw_text(const item &of, const words_at &words) {
    std::string text;
    for (const std::uint16_t word : words_of(of, words)) {
        text += fmt::format("{}0x{:04x}", text.empty() ? "" : " ", word);
    }
    return text;
}

json item_figures(const item &of, const words_at &words) {
    const double value = value_of(of, words);
    json figures = {{"address", of.address}};
    if (!of.name.empty()) figures["name"] = of.name;
    figures["value"] =
        std::isfinite(value) ? json(std::stod(fmt::format("{:.10g}", value))) : json();
    if (!of.unit.empty()) figures["unit"] = of.unit;
    figures["registers"] = words_of(of, words);
    return figures;
}

std::vector<std::uint16_t> encode(const item &to, const std::string &text) {
    const auto fail = [&](const std::string &why) {
        throw input_error(fmt::format("register {}: {}", to.place(), why));
    };
    const auto typed = number_in(text);
    if (!typed) fail(fmt::format("'{}' is not a number; write 12.5, -3 or 0x00ff", text));
    const double raw = (*typed - to.zero) / to.scale;
    const bool whole = to.format.what != fakeplc::number_format::kind::floating;
    if (is_bit(to) && raw != 0.0 && raw != 1.0) fail(fmt::format("a bit is 0 or 1, not {}", text));
    if (whole && to.scale == 1.0 && raw != std::round(raw))
        fail(
            fmt::format("{} has a fraction, and the type is an integer; give --scale, or --type "
                        "float32",
                        text));
    const double low = to.format.lowest(), high = to.format.highest();
    const double stored = whole ? std::round(raw) : raw;
    if (!(stored >= low && stored <= high))
        fail(fmt::format("{} is outside what its type holds, {:.10g} to {:.10g}", text,
                         std::min(low * to.scale, high * to.scale) + to.zero,
                         std::max(low * to.scale, high * to.scale) + to.zero));
    return to.format.encode(stored);
}

}  // namespace compbox::plc
