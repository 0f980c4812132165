// SPDX-License-Identifier: MIT
#include "host-tools/box_files/snapshot.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "host-tools/formats/json.h"

namespace compbox::box_files {

namespace {

constexpr int most_depth = 8;             // of a real one: 4
constexpr std::size_t most_items = 1024;  // of one list; a coefficient file cannot have as many

double seconds(const timespec &time) {
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool same_file(const struct stat &a, const struct stat &b) {
    return a.st_dev == b.st_dev && a.st_ino == b.st_ino && a.st_size == b.st_size &&
           a.st_mtim.tv_sec == b.st_mtim.tv_sec && a.st_mtim.tv_nsec == b.st_mtim.tv_nsec;
}

// out: value[key] is a list of objects with names, none longer than a real one
bool is_named_list(const json &value, const char *key) {
    const auto list = value.find(key);
    if (list == value.end() || !list->is_array() || list->size() > most_items) return false;
    return std::all_of(list->begin(), list->end(), [](const json &one) {
        const auto name = one.is_object() ? one.find("name") : one.end();
        return one.is_object() && name != one.end() && name->is_string();
    });
}

// out: what is wrong with it, after "the snapshot "; "": it has the members that all use
std::string fault_in(const json &value) {
    if (!value.is_object()) return "is no JSON object";
    const auto version = value.find("snapshot");
    if (version == value.end() || *version != 1) {
        return "has another version than 1: compboxd and compbox-view must fit each other";
    }
    for (const char *key : {"mode", "reason"}) {
        const auto word = value.find(key);
        if (word == value.end() || !word->is_string()) return fmt::format("lacks \"{}\"", key);
    }
    for (const char *key : {"signals", "terms", "channels"}) {
        if (!is_named_list(value, key)) return fmt::format("lacks the list \"{}\"", key);
    }
    return "";
}

}  // namespace

double unix_now_s() {
    timespec now = {};
    ::clock_gettime(CLOCK_REALTIME, &now);
    return seconds(now);
}

snapshot_file::snapshot_file(const std::string &path)
    : path_(path), value_(std::make_unique<json>()) {
    drop("has not been read yet");
}

snapshot_file::~snapshot_file() = default;

bool snapshot_file::poll() {
    // O_NONBLOCK: a pipe in place of the file does not block.
    const int descriptor = ::open(path_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) {
        seen_ = {};
        return drop(fmt::format("cannot be read ({}): is compboxd running with --snapshot?",
                                std::strerror(errno)));
    }
    const bool fresh = read(descriptor);
    ::close(descriptor);
    return fresh;
}

// in : an open file. out: it is a new usable snapshot; an unchanged file is not read
bool snapshot_file::read(int descriptor) {
    struct stat now = {};
    if (::fstat(descriptor, &now) != 0 || !S_ISREG(now.st_mode)) {
        seen_ = {};
        return drop("is no regular file");
    }
    if (same_file(now, seen_)) return false;
    seen_ = now;
    if (static_cast<std::size_t>(now.st_size) > snapshot_most_bytes) {
        return drop(fmt::format("has {} bytes, more than {}", now.st_size, snapshot_most_bytes));
    }
    std::string text(static_cast<std::size_t>(now.st_size), '\0');
    const ssize_t got = ::pread(descriptor, text.data(), text.size(), 0);
    if (got < 0) return drop(fmt::format("cannot be read ({})", std::strerror(errno)));
    text.resize(static_cast<std::size_t>(got));
    return parse(text);
}

bool snapshot_file::parse(const std::string &text) {
    const auto shallow = [](int depth, json::parse_event_t, json &) { return depth <= most_depth; };
    json value = json::parse(text, shallow, false);
    if (value.is_discarded()) return drop("is not valid JSON");
    const std::string fault = fault_in(value);
    if (!fault.empty()) return drop(fault);
    text_ = value.dump();
    *value_ = std::move(value);
    why_.clear();
    return true;
}

bool snapshot_file::drop(const std::string &why) {
    why_ = fmt::format("the snapshot {} {}", path_, why);
    text_ = "null";
    *value_ = nullptr;
    return false;
}

std::optional<double> snapshot_file::age_s(double unix_s) const {
    if (seen_.st_ino == 0) return std::nullopt;
    return std::max(0.0, unix_s - seconds(seen_.st_mtim));
}

std::string snapshot_file::why_not(double unix_s) const {
    if (value_->is_null()) return why_;
    if (value_->value("finished", json(false)) == true) {
        return "compboxd has ended; this is its last snapshot";
    }
    const double age = age_s(unix_s).value_or(0.0);
    if (age <= snapshot_stale_s) return "";
    return fmt::format("the snapshot {} is {:.0f} s old: compboxd has ended or stands still", path_,
                       age);
}

std::string snapshot_file::live_text(double unix_s) const {
    const auto age = age_s(unix_s);
    const std::string why = why_not(unix_s);
    return fmt::format(R"({{"snapshot":{},"age_s":{},"stale":{},"why":{}}})", text_,
                       age ? fmt::format("{:.3f}", *age) : "null", !why.empty(),
                       formats::json_line(why));
}

}  // namespace compbox::box_files
