// SPDX-License-Identifier: MIT
#include "host-tools/box_files/event_log.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host-tools/formats/json_type.h"

namespace compbox::box_files {

namespace {

constexpr int old_files = 4;
constexpr std::size_t file_bytes = 2u << 20;  // of one file and one poll; it rotates at 1 MB

}  // namespace

event_log::event_log(const std::string &path) : path_(path), file_(path, event_most_bytes) {}

// Keeps a line that is a JSON object; a power cut can tear one. out: whether it is one
bool event_log::add(std::string_view line) {
    const auto flat = [](int depth, json::parse_event_t, json &) { return depth <= 8; };
    const json value = json::parse(line, flat, false);
    if (!value.is_object()) return false;
    lines_.push_back(value.dump());
    if (lines_.size() > event_log_lines) lines_.pop_front();
    return true;
}

void event_log::read_old() {
    for (int n = old_files; n > 0; --n) {
        followed_file old(path_ + "." + std::to_string(n), event_most_bytes);
        old.poll(file_bytes, {nullptr, [this](std::string_view line) { add(line); }});
    }
}

void event_log::poll(const std::function<void(const std::string &)> &fresh) {
    if (path_.empty()) return;
    if (!is_read_) read_old();
    const bool reports = is_read_;
    is_read_ = true;
    file_.poll(file_bytes, {nullptr, [&](std::string_view line) {
                                if (add(line) && reports) fresh(lines_.back());
                            }});
}

std::string event_log::text(std::size_t limit) const {
    const std::size_t count = std::min(limit, lines_.size());
    std::string out = "[";
    for (std::size_t i = lines_.size() - count; i < lines_.size(); ++i) {
        out += (out.size() > 1 ? "," : "") + lines_[i];
    }
    return out + "]";
}

}  // namespace compbox::box_files
