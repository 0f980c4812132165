// SPDX-License-Identifier: MIT
#include "host-tools/commission/questions.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "host-tools/commission/table.h"
#include "host-tools/formats/error.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::commission {

namespace {

constexpr double longest_silence_s = 3.0;
constexpr std::uint32_t drawn_every_us = 100000, printed_every_us = 1000000;
constexpr double notable = 0.05;  // a printed change: mm, deg, degC …

}  // namespace

std::string questions::line(const std::string &question, const std::string &option,
                            const std::function<void()> &wait) {
    const auto answer = prompt_.ask(question, wait);
    if (answer) return *answer;
    throw input_error(fmt::format("no answer: standard input has ended; give {} instead", option));
}

double questions::micrometres(const std::string &question, const std::string &option,
                              const std::function<void()> &wait) {
    for (;;) {
        if (const auto number = cli::number_in(line(question, option, wait))) return number->value;
        io_.err << "A number in µm, please, as in -19.8\n";
    }
}

// The table on a terminal, with the task in its last lines; elsewhere it is printed.
void questions::begin_table(const live_box &live, const register_map &map) {
    auto lines = table_lines(live, map, current_);
    if (!screen_.is_terminal()) {
        printed_.clear();
        for (const auto &row : map.rows()) printed_.push_back(row.value);
        for (const auto &one : lines) io_.err << one << "\n";
        return;
    }
    lines.resize(std::min(lines.size(), screen_.rows() - 2));
    lines.push_back("");
    lines.push_back(
        fmt::format("{}: {}Enter if the control shows this value, else type what it shows",
                    current_->name, task_.empty() ? "" : task_ + ". "));
    screen_.draw(lines);
}

// The table on a terminal; elsewhere the signals that have changed, one line each.
void questions::go_on_with_table(const live_box &live, const register_map &map) {
    const std::uint32_t every_us = screen_.is_terminal() ? drawn_every_us : printed_every_us;
    if (++cycles_ * live.config().period_us < every_us) return;
    cycles_ = 0;
    if (screen_.is_terminal()) return begin_table(live, map);
    for (std::size_t i = 0; i < map.rows().size(); ++i) {
        const map_row &row = map.rows()[i];
        if (!row.signal || std::abs(row.value - printed_[i]) < notable) continue;
        printed_[i] = row.value;
        io_.err << "\n" << table_line(live, row, current_) << std::flush;
    }
}

void questions::step(live_box &live, register_map &map) {
    live.cycle();
    map.observe(live);
    if (live.age_s() > longest_silence_s) throw input_error(live.no_reply());
    if (watch_ && current_ != nullptr) go_on_with_table(live, map);
}

// out: the question in its line: the name alone below a table that has the rest
std::string questions::question_of(const map_row &row) const {
    if (watch_ && screen_.is_terminal()) return fmt::format("{} > ", row.name);
    const std::string enter = watch_ ? " (Enter if the table agrees)? "
                              : task_.empty()
                                  ? fmt::format(" (Enter if it is {})? ", value_text(row))
                                  : fmt::format(", in {}? ", row.unit);
    return fmt::format("   {}: {}what does the control show{}", row.name,
                       task_.empty() ? "" : task_ + "; ", enter);
}

// in : the row of the map; what to do before the comparison
// out: the display; nothing: a person sees the value and found it equal
std::optional<shown_value> questions::ask(live_box &live, register_map &map, const map_row &row,
                                          const std::string &task) {
    const bool sees_value = watch_ || task.empty();
    for (;;) {
        current_ = &row;
        task_ = task;
        cycles_ = 0;
        if (watch_) begin_table(live, map);
        const std::string answer =
            line(question_of(row), "--shows " + row.name + "=…", [&] { step(live, map); });
        current_ = nullptr;
        screen_.clear();
        if (answer.empty() && sees_value) return std::nullopt;
        if (const auto number = cli::number_in(answer))
            return shown_as(number->value, number->decimals);
        io_.err << fmt::format("A number in {}, please, with all digits of the display\n",
                               row.unit);
    }
}

void questions::again(const std::string &fault) {
    if (!prompt_.at_terminal()) throw input_error(fault);
    io_.err << "   " << fault << "\n";
}

dialog questions::about_positions(live_box &live, register_map &map,
                                  const std::function<void(const std::string &)> &say) {
    return {[this, &live, &map] { step(live, map); },
            [this, &live, &map](const map_row &row, const std::string &task) {
                return ask(live, map, row, task);
            },
            [this](const std::string &fault) { again(fault); }, say};
}

}  // namespace compbox::commission
