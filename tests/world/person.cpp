// SPDX-License-Identifier: MIT
#include "tests/world/person.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>
#include <vector>

namespace compbox::world {

person::person(scheduler &time, computer &box, std::uint64_t seed)
    : time_(time), box_(box), chance_(seed, "person"), links_(seed, "links of a person") {
    time_.at(3 * second, [this] { measure(); });
}

void person::daemon_starts() {
    um_ = 0;
    count_ = 0;
    started_ns_ = time_.now();
    repeats_ = links_.one_in(2);
    tell();
}

// A sample is used for two seconds.
void person::tell() {
    if (told) told(um_, count_);
    time_.at(time_.now() + 1300 * ms, [this, plan = ++told_] {
        if (plan == told_) tell();
    });
}

std::string person::line(double um, std::int64_t unix_s) const {
    return fmt::format("H {:.1f} {} {}\n", um, number_, unix_s);
}

void person::put(const std::string &text) {
    ++files_;
    box_.files.replace(path, text);
}

double person::measured_um() {
    return std::round(chance_.between(-4000, 4000)) / 10;
}

// The box takes nothing of it.
std::string person::mistake(std::int64_t now_s) {
    const double um = measured_um();
    const std::string good = line(um, now_s);
    const std::vector<std::string> wrong = {
        line(um, now_s - static_cast<std::int64_t>(chance_.log_between(303, 1000))),
        line(um, now_s + static_cast<std::int64_t>(chance_.log_between(63, 300))),
        fmt::format("Q {:.1f} {} {}\n", um, number_, now_s),
        good + "H 4.2 1\n",
        good + "a word\n",
        fmt::format("H nan {} {}\n", number_, now_s),
        fmt::format("H 1000001 {} {}\n", number_, now_s),
        fmt::format("H {:.1f} 65536 {}\n", um, now_s),
        fmt::format("H {:.1f} {} {} 5\n", um, number_, now_s),
        "",
        good + std::string(2048, '\n'),
    };
    return chance_.one_of(wrong);
}

void person::measure() {
    const std::int64_t now_s = box_.wall() / second;
    time_.at(time_.now() + chance_.time_between(2 * second, 8 * second), [this] { measure(); });
    // What is in the file at the daemon's first look is from before, and not taken.
    if (time_.now() - started_ns_ < 2 * second) return;
    // Who counts anew each day may come to the same number.
    if (before_.empty() || !chance_.one_in(6)) number_ = (number_ + 1) % 65536;
    const std::string before = std::exchange(before_, "");
    const bool repeats = std::exchange(repeats_, false) && !before.empty();
    switch (repeats ? 3 : chance_.below(8)) {
        case 0:
        case 1:
            return put(mistake(now_s));
        case 2:  // the file is a link, belongs to another user, or other users may write it
            put(line(5, now_s));
            if (links_.one_in(3)) {
                box_.files.remove(path);
                box_.files.make_link(path, "/run/compboxd/elsewhere");
            } else if (chance_.one_in(2))
                box_.files.find(path)->owner = 1001;
            else
                box_.files.find(path)->permissions = chance_.one_in(2) ? 0664 : 0646;
            return;
        case 3:  // the same measurement again, whatever its value
            if (before.empty()) return;
            return put("H 123.4" + before);
        default:
            break;
    }
    um_ = measured_um();
    ++count_;
    before_ = fmt::format(" {} {}\n", number_, now_s);
    put((chance_.one_in(3) ? fmt::format("A 1.5 {} {}\n", number_, now_s) : "") + line(um_, now_s));
    tell();
}

}  // namespace compbox::world
