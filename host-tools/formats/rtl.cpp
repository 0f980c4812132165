// SPDX-License-Identifier: MIT
#include "host-tools/formats/rtl.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "host-tools/formats/error.h"
#include "host-tools/formats/units.h"

namespace compbox::formats {

namespace {

constexpr double urad_per_mrad = 1000.0;
constexpr double hPa_per_kPa = 10.0;

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

bool starts_with(std::string_view text, std::string_view start) {
    return text.substr(0, start.size()) == start;
}

bool contains(std::string_view text, std::string_view part) {
    return text.find(part) != std::string_view::npos;
}

std::string without_quotes(std::string_view text) {
    std::string result(text);
    result.erase(std::remove(result.begin(), result.end(), '"'), result.end());
    return result;
}

// out: a finite number; a comma is a decimal point
std::optional<double> number_of(std::string_view word) {
    if (!word.empty() && word[0] == '+') word.remove_prefix(1);
    std::string digits(word);
    std::replace(digits.begin(), digits.end(), ',', '.');
    double value = 0.0;
    const char *end = digits.data() + digits.size();
    const auto result = std::from_chars(digits.data(), end, value);
    if (result.ec != std::errc() || result.ptr != end || !std::isfinite(value)) return {};
    return value;
}

// out: the numbers up to the first other word, which `rest` receives
std::vector<double> leading_numbers(std::string_view text, std::string_view *rest = nullptr) {
    std::vector<double> values;
    std::string_view word;
    while (!(text = trim(text)).empty()) {
        word = text.substr(0, text.find_first_of(" \t"));
        const auto value = number_of(word);
        if (!value) break;
        values.push_back(*value);
        text.remove_prefix(word.size());
    }
    if (rest != nullptr) *rest = text.empty() ? text : word;
    return values;
}

// "20.3" or "20.3 to 20.8", with one decimal.
std::string span_of(const start_and_end &values) {
    const std::string start = fmt::format("{:.1f}", values.start);
    const std::string end = fmt::format("{:.1f}", values.end);
    return start == end ? start : start + " to " + end;
}

// One line of the file: its number, and key and value if it has a colon.
struct text_line {
    long number;
    std::string_view text;
    std::string key;         // lower case; empty without a colon
    std::string_view value;  // trimmed
};

enum class content { unknown, length, angle, rotary };

struct content_word {
    const char *word;
    content means;
};

// Words of "File type" and "Owner" in the header, and endings of names.
constexpr content_word header_words[] = {
    {"rotary", content::rotary},       {"angular", content::angle}, {"angle", content::angle},
    {"rta", content::angle},           {"linear", content::length}, {"rtl", content::length},
    {"straightness", content::length}, {"rts", content::length},    {"flatness", content::length},
    {"position", content::length}};
constexpr content_word endings[] = {
    {".rta", content::angle}, {".rtl", content::length}, {".rts", content::length}};

content content_of_name(const std::string &path) {
    for (const auto &ending : endings) {
        if (ends_in(path, ending.word)) return ending.means;
    }
    return content::unknown;
}

// Parses the file in one pass: a section name, then its lines, each with the section's reader.
class laser_reader {
  public:
    laser_reader(const std::string &path, std::string_view text, const std::string &unit)
        : path_(path), text_(text), unit_(unit) {
        result_.file = path;
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
            if (section_ == "header") header_line(line);
            if (section_ == "target data") target_line(line);
            if (section_ == "user-text") user_line(line);
            if (section_ == "equipment") equipment_line(line);
            if (section_ == "runs") run_line(line);
            if (section_ == "deviations") deviation_line(line);
            if (section_ == "environment") environment_line(line);
        }
        check_whole();
        scale_deviations();
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
        std::string_view rest;
        const std::vector<double> values = leading_numbers(text, &rest);
        if (!rest.empty()) fail(line, fmt::format("'{}' is not a number", rest));
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

    void header_line(const text_line &line) {
        if (line.key != "file type" && line.key != "filetype" && line.key != "owner") return;
        for (const auto &one : header_words) {
            if (!contains(lower(line.value), one.word)) continue;
            header_ = one.means;
            return;
        }
    }

    // out: what the deviations are, by the header and the name's ending; throws where they differ
    content stated_content() const {
        const content by_name = content_of_name(path_);
        if (header_ == content::rotary) {
            throw input_error(path_, 0, 0, "holds a rotary axis; these are not read yet");
        }
        if (header_ != content::unknown && by_name != content::unknown && header_ != by_name) {
            throw input_error(path_, 0, 0,
                              "holds {} by its header and {} by its name: give --unit um or --unit "
                              "mrad",
                              header_ == content::angle ? "angles" : "lengths",
                              by_name == content::angle ? "angles" : "lengths");
        }
        return header_ != content::unknown ? header_ : by_name;
    }

    // out: result_.angular, and the deviations in µm or µrad
    void scale_deviations() {
        const content stated = unit_.empty() ? stated_content() : content::unknown;
        if (stated == content::unknown && unit_.empty()) {
            throw input_error(path_, 0, 0,
                              "states neither in its header nor by its name whether it holds "
                              "lengths or angles: give --unit um or --unit mrad");
        }
        const measuring_unit *in = find_unit(!unit_.empty()             ? unit_
                                             : stated == content::angle ? "mrad"
                                                                        : "um");
        if (in == nullptr || (in->of != quantity::length && in->of != quantity::angle)) {
            throw input_error("--unit: '" + unit_ + "' is no unit of a length or an angle");
        }
        result_.angular = in->of == quantity::angle;
        for (auto &run : result_.runs) {
            for (double &deviation : run.deviation) deviation *= in->factor;
        }
        if (!result_.repeated) return;
        result_.repeated->first *= in->factor;
        result_.repeated->again *= in->factor;
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

    // "Laser : XL-80", "Serial: 12": the words behind the colon in one text.
    void equipment_line(const text_line &line) {
        if (line.value.empty()) return;
        if (!result_.instrument.empty()) result_.instrument += ", ";
        result_.instrument += line.value;
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
            return repeat_line(line, run, target, values[2]);
        }
        readings.target.push_back(target);
        readings.deviation.push_back(values[2]);
        readings.line.push_back(line.number);
    }

    // in : a target that the run has already
    // out: the repeated first target, if the run is whole and the target is the first of all
    void repeat_line(const text_line &line, std::size_t run, std::size_t target, double deviation) {
        const bool whole = result_.runs[run].target.size() == result_.targets_mm.size();
        const laser_run &first = result_.runs.front();
        if (!whole || result_.repeated || first.target.empty() || target != first.target.front()) {
            fail(line, fmt::format("target {} is there twice in run {}", target + 1, run + 1));
        }
        repeat_line_ = line;
        repeat_run_ = run;
        result_.repeated = {result_.targets_mm[target], first.deviation.front(), deviation};
    }

    // "Air temp : 20.1 20.3 0": start, end, and a unit's number. Lines of other programs are
    // skipped.
    void environment_line(const text_line &line) {
        if (!result_.environment) result_.environment.emplace();
        laser_environment &into = *result_.environment;
        if (starts_with(line.key, "date")) into.times = without_quotes(line.value);
        const auto values = leading_numbers(line.value);
        if (values.empty()) return;
        const start_and_end pair{values[0], values.size() > 1 ? values[1] : values[0]};
        const auto plausible = [&](double low, double high) {
            return std::min(pair.start, pair.end) > low && std::max(pair.start, pair.end) < high;
        };
        if (starts_with(line.key, "air temp") && plausible(-9.0, 80.0)) into.air_degC = pair;
        if (starts_with(line.key, "air press") && plausible(50.0, 120.0)) into.air_kPa = pair;
        if (starts_with(line.key, "air press") && plausible(500.0, 1200.0)) {
            into.air_kPa = start_and_end{pair.start / hPa_per_kPa, pair.end / hPa_per_kPa};
        }
        if (starts_with(line.key, "air humid") && plausible(0.0, 100.1)) {
            into.humidity_percent = pair;
        }
        if (starts_with(line.key, "mat") && contains(line.key, "temp") && plausible(-9.0, 80.0)) {
            into.material_degC.push_back(pair);
        }
        if (contains(line.key, "exp") && contains(line.key, "coeff")) {
            into.expansion_um_per_m_K = pair.start;
        }
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
        if (result_.repeated && repeat_run_ + 1 != result_.runs.size()) {
            fail(repeat_line_,
                 fmt::format("the first target is there twice in run {}; only the last run may "
                             "repeat it, for the drift",
                             repeat_run_ + 1));
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
    const std::string &unit_;
    content header_ = content::unknown;
    std::size_t at_ = 0;
    long number_ = 0;
    std::string section_;
    bool in_targets_ = false, ended_ = false;
    std::size_t target_count_ = 0, run_count_ = 0;
    text_line repeat_line_{};
    std::size_t repeat_run_ = 0;
    laser_file result_;
};

}  // namespace

bool is_laser_text(const std::string &path, const std::string &text) {
    if (content_of_name(path) != content::unknown) return true;
    const std::size_t start = text.find_first_not_of(" \t\n");
    if (start == std::string::npos) return false;
    const std::string line = lower(std::string_view(text).substr(start, 16));
    return starts_with(line, "header::") || starts_with(line, "target data::");
}

laser_file read_laser_text(const std::string &path, const std::string &text,
                           const std::string &unit) {
    return laser_reader(path, text, unit).read();
}

std::optional<start_and_end> laser_environment::mean_material_degC() const {
    if (material_degC.empty()) return {};
    start_and_end mean;
    const double sensors = static_cast<double>(material_degC.size());
    for (const auto &one : material_degC) {
        mean.start += one.start / sensors;
        mean.end += one.end / sensors;
    }
    return mean;
}

std::string environment_text(const laser_environment &environment) {
    std::string text;
    const auto add = [&](const std::string &part) { text += (text.empty() ? "" : ", ") + part; };
    if (environment.air_degC) add(fmt::format("air {} °C", span_of(*environment.air_degC)));
    if (environment.air_kPa) add(fmt::format("{} kPa", span_of(*environment.air_kPa)));
    if (environment.humidity_percent) {
        add(fmt::format("{} % humidity", span_of(*environment.humidity_percent)));
    }
    for (const auto &material : environment.material_degC) {
        add(fmt::format("material {} °C", span_of(material)));
    }
    if (environment.material_compensated()) {
        add(fmt::format("readings converted to 20 °C by {:g} um/m per K",
                        *environment.expansion_um_per_m_K));
    }
    return text;
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

}  // namespace compbox::formats
