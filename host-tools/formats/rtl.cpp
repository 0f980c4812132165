// SPDX-License-Identifier: MIT
#include "host-tools/formats/rtl.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/text.h"

namespace compbox {

namespace {

constexpr double urad_per_mrad = 1000.0;

std::string_view trim(std::string_view text) {
    const char *blank = " \t\r";
    const auto first = text.find_first_not_of(blank);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::string lower(std::string_view text) {
    std::string result(text);
    for (char &c : result) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return result;
}

bool ends_in(const std::string &path, const std::string &ending) {
    return path.size() >= ending.size() &&
           lower(path).substr(path.size() - ending.size()) == ending;
}

// One line of the file: its number, and key and value if it has a colon.
struct text_line {
    long number;
    std::string_view text;
    std::string key;         // lower case; empty without a colon
    std::string_view value;  // trimmed
};

// Parses the file in one pass: a section name, then its lines, each with the section's reader.
class laser_reader {
  public:
    laser_reader(const std::string &path, std::string_view text) : path_(path), text_(text) {
        result_.file = path;
        result_.angular = ends_in(path, ".rta");
    }

    // Reads all sections and checks them against each other. Throws input_error with the line.
    laser_file read() {
        for (text_line line; next(line);) {
            const std::string_view ending = "::";
            if (line.text.size() > 2 && line.text.substr(line.text.size() - 2) == ending) {
                section_ = lower(line.text.substr(0, line.text.size() - 2));
                if (section_ == "eof") {
                    ended_ = true;
                    break;
                }
                continue;
            }
            if (section_.empty()) fail(line, "a section such as HEADER:: must come first");
            if (section_ == "target data") target_line(line);
            if (section_ == "user-text") user_line(line);
            if (section_ == "runs") run_line(line);
            if (section_ == "deviations") deviation_line(line);
        }
        check_whole();
        return std::move(result_);
    }

  private:
    [[noreturn]] void fail(const text_line &line, const std::string &sentence) const {
        throw input_error(path_, line.number, 0, sentence);
    }

    // out: the next line that is not empty; false at the end
    bool next(text_line &line) {
        while (at_ < text_.size()) {
            const std::size_t end = std::min(text_.find('\n', at_), text_.size());
            line.text = trim(text_.substr(at_, end - at_));
            line.number = ++number_;
            at_ = end + 1;
            if (line.text.empty()) continue;
            const auto colon = line.text.find(':');
            const bool keyed = colon != std::string_view::npos;
            line.key = keyed ? lower(trim(line.text.substr(0, colon))) : "";
            line.value = keyed ? trim(line.text.substr(colon + 1)) : line.text;
            return true;
        }
        return false;
    }

    // out: all numbers of a text, separated by blanks; a comma is a decimal point
    std::vector<double> numbers(const text_line &line, std::string_view text) const {
        std::vector<double> values;
        while (!(text = trim(text)).empty()) {
            const std::size_t length = std::min(text.find_first_of(" \t"), text.size());
            std::string digits(
                text.substr(text[0] == '+' ? 1 : 0, text[0] == '+' ? length - 1 : length));
            std::replace(digits.begin(), digits.end(), ',', '.');
            double value = 0.0;
            const char *end = digits.data() + digits.size();
            const auto result = std::from_chars(digits.data(), end, value);
            if (result.ec != std::errc() || result.ptr != end || !std::isfinite(value)) {
                fail(line, fmt::format("'{}' is not a number", text.substr(0, length)));
            }
            values.push_back(value);
            text.remove_prefix(length);
        }
        return values;
    }

    std::size_t count(const text_line &line) const {
        const auto values = numbers(line, line.value);
        if (values.size() != 1 || values[0] < 1 || values[0] > 100000 ||
            values[0] != std::floor(values[0])) {
            fail(line, "expected a count from 1 to 100000");
        }
        return static_cast<std::size_t>(values[0]);
    }

    void target_line(const text_line &line) {
        if (line.key == "target-count") {
            target_count_ = count(line);
        } else if (line.key == "filetype" || line.key == "flags") {
            in_targets_ = false;
        } else if (line.key == "targets" || (line.key.empty() && in_targets_)) {
            in_targets_ = true;
            for (const double target : numbers(line, line.value)) add_target(line, target);
        }
    }

    void add_target(const text_line &line, double target) {
        auto &targets = result_.targets_mm;
        const std::size_t n = targets.size();
        const bool up = n < 2 || targets[1] > targets[0];
        if (n > 0 && (target == targets.back() || (n > 1 && (target > targets.back()) != up))) {
            fail(line, "the targets must ascend (or descend), and one of them does not");
        }
        targets.push_back(target);
    }

    void user_line(const text_line &line) {
        const struct {
            const char *key;
            std::string &place;
        } fields[] = {{"machine", result_.machine}, {"serial no", result_.serial},
                      {"date", result_.date},       {"by", result_.by},
                      {"axis", result_.axis},       {"location", result_.location},
                      {"title", result_.title}};
        for (const auto &field : fields) {
            if (line.key == field.key) field.place = std::string(line.value);
        }
    }

    void run_line(const text_line &line) {
        if (line.key == "run-count") run_count_ = count(line);
    }

    void deviation_line(const text_line &line) {
        if (!line.key.empty()) return;  // "Run Target Data:"
        const auto values = numbers(line, line.text);
        if (values.size() != 3) fail(line, "expected run, target and deviation");
        const std::size_t run = index(line, values[0], std::max<std::size_t>(run_count_, 1), "run");
        const std::size_t target = index(line, values[1], result_.targets_mm.size(), "target");
        if (result_.runs.size() <= run) result_.runs.resize(run + 1);
        auto &readings = result_.runs[run];
        if (std::find(readings.target.begin(), readings.target.end(), target) !=
            readings.target.end()) {
            fail(line, fmt::format("target {} is there twice in run {}", target + 1, run + 1));
        }
        readings.target.push_back(target);
        readings.deviation.push_back(values[2] * (result_.angular ? urad_per_mrad : 1.0));
        readings.line.push_back(line.number);
    }

    // A 1-based number of the file as a 0-based index below `size`.
    std::size_t index(const text_line &line, double value, std::size_t size,
                      const std::string &what) const {
        if (!(value >= 1) || value > static_cast<double>(size) || value != std::floor(value)) {
            fail(line, fmt::format("the {} must be a number from 1 to {}", what, size));
        }
        return static_cast<std::size_t>(value) - 1;
    }

    // Throws input_error if targets or runs are missing or differ from the counts of the header.
    void check_whole() {
        const text_line end{number_, {}, {}, {}};
        if (result_.targets_mm.size() < 2) {
            fail(end, "fewer than two targets were found in TARGET DATA::");
        }
        if (target_count_ != 0 && target_count_ != result_.targets_mm.size()) {
            fail(end, fmt::format("Target-count is {}, but there are {} targets", target_count_,
                                  result_.targets_mm.size()));
        }
        if (result_.runs.empty()) fail(end, "no readings were found in DEVIATIONS::");
        if (run_count_ != 0 && run_count_ != result_.runs.size()) {
            fail(end, fmt::format("Run-count is {}, but there are {} runs", run_count_,
                                  result_.runs.size()));
        }
        check_end(end);
        ascend();
        for (std::size_t run = 0; run < result_.runs.size(); ++run) {
            check_run(end, result_.runs[run], run + 1);
        }
    }

    // A file without EOF:: may be truncated, in a line or in a run.
    void check_end(const text_line &end) const {
        if (ended_) return;
        if (text_.back() != '\n') fail(end, "the file ends within a line, without EOF::");
        const std::size_t last = result_.runs.back().target.size();
        if (last < result_.targets_mm.size()) {
            fail(end, fmt::format("the file ends within run {} ({} of {} targets), without EOF::",
                                  result_.runs.size(), last, result_.targets_mm.size()));
        }
    }

    // Reverses descending targets, such as 0 to -1000; run 1 is then a backward run.
    void ascend() {
        auto &targets = result_.targets_mm;
        if (targets[1] > targets[0]) return;
        std::reverse(targets.begin(), targets.end());
        for (auto &run : result_.runs) {
            for (auto &target : run.target) target = targets.size() - 1 - target;
        }
    }

    // Checks that a run ascends or descends. A backward run makes the file bidirectional.
    void check_run(const text_line &end, laser_run &run, std::size_t number) {
        if (run.target.empty()) fail(end, fmt::format("run {} has no readings", number));
        const bool up = std::is_sorted(run.target.begin(), run.target.end());
        const bool down = std::is_sorted(run.target.rbegin(), run.target.rend());
        if (!up && !down) {
            throw input_error(path_, run.line.front(), 0,
                              "run {} goes through its targets neither upward nor downward",
                              number);
        }
        run.direction = up ? 1 : -1;
        if (run.direction != result_.runs.front().direction) result_.bidirectional = true;
    }

    const std::string &path_;
    std::string_view text_;
    std::size_t at_ = 0;
    long number_ = 0;
    std::string section_;
    bool in_targets_ = false, ended_ = false;
    std::size_t target_count_ = 0, run_count_ = 0;
    laser_file result_;
};

}  // namespace

bool is_laser_file(const std::string &path) {
    return ends_in(path, ".rtl") || ends_in(path, ".rta");
}

laser_file read_laser(const std::string &path) {
    const std::string text = to_utf8(read_file(path));
    return laser_reader(path, text).read();
}

std::string laser_text(const laser_file &file) {
    std::string out = "HEADER::\r\nFile Type: ";
    out += file.angular ? "Angular" : "Linear";
    out += "\r\nTARGET DATA::\r\nFiletype : ISO\r\n";
    out += fmt::format("Target-count: {}\r\nTargets :", file.targets_mm.size());
    for (std::size_t i = 0; i < file.targets_mm.size(); ++i) {
        out += fmt::format("{}{:14.5f}", i % 5 == 0 ? "\r\n" : " ", file.targets_mm[i]);
    }
    out += "\r\nFlags: 0 0 0 0\r\nUSER-TEXT::\r\n";
    out += fmt::format(
        "Machine:{}\r\nSerial No:{}\r\nDate:{}\r\nBy:{}\r\nAxis:{}\r\nLocation:{}\r\nTITLE:{}\r\n",
        file.machine, file.serial, file.date, file.by, file.axis, file.location, file.title);
    out += fmt::format("RUNS::\r\nRun-count: {}\r\n", file.runs.size());
    out += "DEVIATIONS::\r\nRun Target Data:\r\n";
    const double unit = file.angular ? urad_per_mrad : 1.0;
    for (std::size_t run = 0; run < file.runs.size(); ++run) {
        for (std::size_t i = 0; i < file.runs[run].target.size(); ++i) {
            out += fmt::format("{:3} {:3} {:.{}f}\r\n", run + 1, file.runs[run].target[i] + 1,
                               file.runs[run].deviation[i] / unit, file.angular ? 6 : 3);
        }
    }
    out += "EOF::\r\n";
    return out;
}

}  // namespace compbox
