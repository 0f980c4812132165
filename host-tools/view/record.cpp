// SPDX-License-Identifier: MIT
#include "host-tools/view/record.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <limits>

#include "host-tools/box_files/snapshot.h"
#include "host-tools/formats/text.h"

namespace compbox::view {

namespace {

constexpr std::size_t most_line = 16384;           // a row has at most 8192 bytes
constexpr std::size_t bytes_in_poll = 1u << 20;    // some milliseconds of work
constexpr std::size_t most_bytes_back = 1u << 30;  // of the newest file; the rest of it is left out
constexpr unsigned most_older = 999;
// Reads the number at the start of a cell. out: `otherwise` without one
template <typename Number>
Number number_of(std::string_view cell, Number otherwise) {
    Number number = otherwise;
    std::from_chars(cell.data(), cell.data() + cell.size(), number);
    return number;
}

// in : bytes from the end of a file. out: the time of its last whole row, 0 if there is no_value
double last_time_s(std::string_view bytes) {
    const std::size_t end = bytes.rfind('\n');
    if (end == std::string_view::npos) return 0.0;
    const std::size_t before = bytes.rfind('\n', end == 0 ? 0 : end - 1);
    const std::size_t start = before == std::string_view::npos || before == end ? 0 : before + 1;
    return number_of(bytes.substr(start, end - start), 0.0);
}

// in : wall clock of the file's last writing
// out: the wall clock at time_s = 0
double zero_of(int descriptor, const struct stat &status) {
    std::string bytes(most_line, '\0');
    const auto size = static_cast<std::size_t>(status.st_size);
    const std::size_t from = size - std::min(size, bytes.size());
    const ssize_t got = ::pread(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(from));
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return static_cast<double>(status.st_mtim.tv_sec) - last_time_s(bytes);
}

// out: the byte behind the next line end
std::size_t line_behind(int descriptor, std::size_t from) {
    std::string bytes(most_line, '\0');
    const ssize_t got = ::pread(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(from));
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return from + std::min(bytes.find('\n'), bytes.size() - 1) + 1;
}

}  // namespace

record::record(const std::string &path)
    : path_(path), file_(path, most_line), older_lines_(most_line) {
    if (path.empty()) older_ = 0;
}

record::~record() {
    if (older_file_ != nullptr) ::gzclose(older_file_);
}

// Reads the header. out: the byte from which the rows are wanted: of a huge file its end
std::size_t record::begin(int descriptor) {
    struct stat status = {};
    std::string head(most_line, '\0');
    newest_ = table();
    const ssize_t got = ::pread(descriptor, head.data(), head.size(), 0);
    const std::size_t end =
        head.substr(0, static_cast<std::size_t>(std::max<ssize_t>(got, 0))).find('\n');
    if (end == std::string::npos || ::fstat(descriptor, &status) != 0) return 0;
    take_header(newest_, std::string_view(head).substr(0, end));
    newest_.unix_s_of_time_zero = zero_of(descriptor, status);
    const auto size = static_cast<std::size_t>(status.st_size);
    return size <= most_bytes_back ? end + 1 : line_behind(descriptor, size - most_bytes_back);
}

void record::take_header(table &of, std::string_view line) {
    of = table();
    for (const auto &name : formats::split(std::string(line), ',')) {
        const int place = name == "time_s"   ? time_part
                          : name == "mode"   ? mode_part
                          : name == "reason" ? reason_part
                          : name == "unix_s" ? unix_part
                                             : static_cast<int>(of.names.size());
        if (place >= 0) of.names.push_back(name);
        of.place.push_back(place);
    }
    history_.set_names(of.names);
}

// in : a line with as many cells as the header; others are left out
void record::take_row(table &of, std::string_view line, double unix_s) {
    double time_s = std::numeric_limits<double>::quiet_NaN(), wall_s = time_s;
    int mode = -1, reason = -1;
    std::size_t cell = 0, start = 0;
    row_.assign(of.names.size(), no_value);
    for (; start <= line.size() && cell < of.place.size(); ++cell) {
        const std::size_t end = std::min(line.find(',', start), line.size());
        const std::string_view text = line.substr(start, end - start);
        start = end + 1;
        switch (of.place[cell]) {
            case time_part:
                time_s = number_of(text, time_s);
                break;
            case unix_part:
                wall_s = number_of(text, wall_s);
                break;
            case mode_part:
                mode = number_of(text, mode);
                break;
            case reason_part:
                reason = number_of(text, reason);
                break;
            default:
                row_[static_cast<std::size_t>(of.place[cell])] = number_of(text, no_value);
        }
    }
    if (cell != of.place.size() || start <= line.size()) return;
    if (!of.unix_s_of_time_zero) of.unix_s_of_time_zero = unix_s - time_s;
    oldest_s_ = wall_s == wall_s ? wall_s : time_s + *of.unix_s_of_time_zero;
    history_.add(oldest_s_, mode, reason, row_);
    has_rows_ = true;
}

void record::take(table &of, std::string_view line, double unix_s) {
    if (line.rfind("time_s,", 0) == 0) {
        take_header(of, line);
    } else {
        take_row(of, line, unix_s);
    }
}

// Opens the next older file. out: false: there is no_value, or it is older than the history
bool record::open_older() {
    const std::string name = path_ + "." + std::to_string(older_);
    for (const std::string &one : {name + ".gz", name}) {
        struct stat status = {};
        if (::stat(one.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
        older_file_ = ::gzopen(one.c_str(), "rbe");
        older_table_ = table();
        older_lines_.clear();
        if (older_file_ != nullptr) return true;
    }
    return false;
}

// Reads a piece of the older files; the one after them is taken in the next call.
void record::read_older(double unix_s) {
    char bytes[65536];
    if (older_file_ == nullptr && (older_ > most_older || !open_older())) {
        older_ = 0;
        return;
    }
    history_.set_names(older_table_.names);
    for (std::size_t done = 0; done < bytes_in_poll;) {
        const int got = ::gzread(older_file_, bytes, sizeof bytes);
        if (got > 0) {
            done += static_cast<std::size_t>(got);
            older_lines_.add(std::string_view(bytes, static_cast<std::size_t>(got)),
                             [&](std::string_view line) { take(older_table_, line, unix_s); });
            continue;
        }
        ::gzclose(older_file_);
        older_file_ = nullptr;
        const bool is_old = oldest_s_ < unix_s - 3600.0 * history_most_hours;
        older_ = is_old ? 0 : older_ + 1;
        return;
    }
}

bool record::poll(double unix_s) {
    if (path_.empty()) return false;
    has_rows_ = false;
    history_.set_names(newest_.names);
    const auto begins = [this](int descriptor) { return begin(descriptor); };
    const auto takes = [&](std::string_view line) { take(newest_, line, unix_s); };
    const bool is_read = file_.poll(bytes_in_poll, {begins, takes});
    if (is_read && older_ > 0) read_older(unix_s);
    return has_rows_;
}

}  // namespace compbox::view
