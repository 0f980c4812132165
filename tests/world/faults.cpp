// SPDX-License-Identifier: MIT
#include "tests/world/faults.h"

#include <fmt/core.h>

#include <stdexcept>

#include "host-tools/formats/text.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

constexpr std::size_t remembered = 8;

const std::map<std::string, fault_kind> &names() {
    static const std::map<std::string, fault_kind> all = {
#define X(name, words) {#name, fault_kind::name},
        WORLD_FAULTS(X)
#undef X
    };
    return all;
}

}  // namespace

std::string name_of(fault_kind kind) {
    for (const auto &entry : names()) {
        if (entry.second == kind) return entry.first;
    }
    return "";
}

fault_set fault_set_of(const std::string &text) {
    fault_set kinds;
    if (text == "none") return kinds;
    if (text == "all") {
        for (const auto &entry : names()) kinds.insert(entry.second);
        return kinds;
    }
    for (const auto &name : split(text, ',')) {
        const auto found = names().find(name);
        if (found == names().end())
            throw std::invalid_argument("unknown fault '" + name + "'; see world --help");
        kinds.insert(found->second);
    }
    return kinds;
}

std::string text_of(const fault_set &kinds) {
    if (kinds.size() == names().size()) return "all";
    std::string text;
    for (const fault_kind kind : kinds) text += (text.empty() ? "" : ",") + name_of(kind);
    return text.empty() ? "none" : text;
}

fault_injector::fault_injector(run &of, const fault_set &kinds, std::uint64_t seed)
    : of_(of), kinds_(kinds) {
    for (const auto &entry : names()) chances_.emplace(entry.second, dice(seed, entry.first));
}

void fault_injector::note(fault_kind kind, const std::string &words) {
    ++count_;
    if (last_.size() == remembered) last_.erase(last_.begin());
    last_.push_back(fmt::format("{:.6f} s: {}: {}", static_cast<double>(of_.time.now()) * 1e-9,
                                name_of(kind), words));
}

void fault_injector::repeat(fault_kind kind, time_ns mean, const std::function<void()> &what) {
    if (!has(kind)) return;
    of_.time.at(of_.time.now() + chance(kind).time_between(0, 2 * mean), [this, kind, mean, what] {
        if (has(kind)) what();
        repeat(kind, mean, what);
    });
}

void fault_injector::begin() {
    plan_operator();
    plan_wires();
    repeat(fault_kind::reset, 20 * second, [this] {
        note(fault_kind::reset, "the PLC resets its connections");
        of_.plc.close_all();
    });
}

void fault_injector::plan_operator() {
    repeat(fault_kind::enable, 10 * second, [this] {
        const bool on = chance(fault_kind::enable).one_in(2);
        note(fault_kind::enable, on ? "enable on" : "enable off");
        of_.plc.catch_up();
        of_.plc.control.set_enable(on);
        if (on) of_.plc.control.press_reset();
    });
}

call_fate fault_injector::at_call(const call_site &site) {
    call_fate fate;
    if (has(fault_kind::delay) && chance(fault_kind::delay).one_in(5000)) {
        dice &drawn = chance(fault_kind::delay);
        fate.delay_ns = static_cast<time_ns>(drawn.log_between(10e3, 200e6));
        note(fault_kind::delay,
             fmt::format("{} {} takes {} µs", site.name, site.path, fate.delay_ns / us));
    }
    return fate;
}

preemption fault_injector::between_lines() {
    if (!has(fault_kind::preempt)) return {0, std::int64_t{1} << 20};
    dice &drawn = chance(fault_kind::preempt);
    ++count_;
    return {static_cast<time_ns>(drawn.log_between(1e3, 20e6)),
            static_cast<std::int64_t>(drawn.below(20000))};
}

segment_fate fault_injector::at_segment(bool, std::size_t bytes) {
    segment_fate fate;
    if (has(fault_kind::delay) && chance(fault_kind::delay).one_in(200))
        fate.delay_ns = static_cast<time_ns>(chance(fault_kind::delay).log_between(100e3, 500e6));
    if (has(fault_kind::tear) && bytes > 1 && chance(fault_kind::tear).one_in(50)) {
        fate.cut_at = 1 + chance(fault_kind::tear).below(bytes - 1);
        fate.rest_ns = static_cast<time_ns>(chance(fault_kind::tear).log_between(10e3, 100e6));
    }
    if (has(fault_kind::loss) && chance(fault_kind::loss).one_in(5000)) {
        fate.lost = true;
        note(fault_kind::loss, "the connection stalls");
    }
    if (has(fault_kind::reset) && chance(fault_kind::reset).one_in(5000)) {
        fate.reset = true;
        note(fault_kind::reset, "the connection is reset");
    }
    return fate;
}

segment_fate fault_injector::at_connect() {
    segment_fate fate;
    if (has(fault_kind::loss) && chance(fault_kind::loss).one_in(5)) fate.lost = true;
    if (has(fault_kind::delay) && chance(fault_kind::delay).one_in(3))
        fate.delay_ns = chance(fault_kind::delay).time_between(0, 1500 * ms);
    return fate;
}

reply_fate fault_injector::at_request(const byte_string &) {
    reply_fate fate;
    if (has(fault_kind::loss)) fate.lost = chance(fault_kind::loss).one_in(500);
    if (has(fault_kind::twice)) fate.twice = chance(fault_kind::twice).one_in(500);
    if (has(fault_kind::exception) && chance(fault_kind::exception).one_in(500))
        fate.exception = static_cast<int>(1 + chance(fault_kind::exception).below(11));
    if (has(fault_kind::exception)) fate.torn = chance(fault_kind::exception).one_in(200);
    return fate;
}

}  // namespace compbox::world
