// SPDX-License-Identifier: MIT
#include "tests/world/faults.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "host-tools/formats/text.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

constexpr std::size_t remembered = 12;

constexpr std::array<const char *, fault_kinds> names = {
#define X(name, words) #name,
    WORLD_FAULTS(X)
#undef X
};

fault_set every_kind() {
    fault_set kinds;
    for (std::size_t k = 0; k < fault_kinds; ++k) kinds.insert(static_cast<fault_kind>(k));
    return kinds;
}

// out: kinds that have much to show on this machine, the richest of them several times
std::vector<fault_kind> rich_kinds(const machine &of) {
    std::vector<fault_kind> kinds = {
        fault_kind::sensors, fault_kind::reload,    fault_kind::enable, fault_kind::loss,
        fault_kind::restart, fault_kind::plc_stop,  fault_kind::kill,   fault_kind::disk,
        fault_kind::mute,    fault_kind::exception, fault_kind::foreign};
    const auto add = [&kinds](fault_kind kind, bool has, std::size_t times) {
        kinds.insert(kinds.end(), has ? times : 0, kind);
    };
    add(fault_kind::can, !of.nodes.empty(), 4);
    add(fault_kind::line, !of.plc_device.empty(), 2);
    add(fault_kind::line, !of.modules.empty(), 2);
    add(fault_kind::foreign, !of.pairs.empty(), 1);
    add(fault_kind::sensors, !of.redundant.empty(), 2);
    add(fault_kind::sensors, of.twin.signals.size() > 2, 2);
    add(fault_kind::restart, !of.map.probes.empty(), 2);
    add(fault_kind::reload, !of.map.probes.empty(), 2);
    return kinds;
}

bool can_act_on(const machine &of, fault_kind kind) {
    if (kind == fault_kind::can) return !of.nodes.empty();
    if (kind == fault_kind::line) return !of.plc_device.empty() || !of.modules.empty();
    return true;
}

// The second one shows most of what the first one does.
constexpr std::pair<fault_kind, fault_kind> companions[] = {
    {fault_kind::clock, fault_kind::power_cut},   {fault_kind::plc_stop, fault_kind::loss},
    {fault_kind::kill, fault_kind::restart},      {fault_kind::reload, fault_kind::sensors},
    {fault_kind::foreign, fault_kind::exception},
};

void add_companions(fault_set &kinds, dice &chance) {
    for (const auto &[kind, other] : companions)
        if (kinds.count(kind) > 0 && chance.one_in(3)) kinds.insert(other);
}

// One alone, with its companion at most: the rules are at their sharpest there, and each kind has
// to come often.
fault_set one_kind(dice &chance, const machine &of) {
    std::vector<fault_kind> acting;
    for (const fault_kind kind : every_kind())
        if (can_act_on(of, kind)) acting.push_back(kind);
    fault_set kinds = {chance.one_of(chance.one_in(2) ? acting : rich_kinds(of))};
    add_companions(kinds, chance);
    return kinds;
}

// Up to three, now and then with an end of the daemon or another file, which shows what comes
// behind it. Half of them are rich ones.
fault_set few_kinds(dice &chance, const machine &of) {
    static const std::vector<fault_kind> ends = {fault_kind::kill, fault_kind::power_cut,
                                                 fault_kind::restart, fault_kind::reload};
    const std::vector<fault_kind> rich = rich_kinds(of);
    fault_set kinds;
    for (std::uint64_t i = 0, count = 1 + chance.below(3); i < count; ++i) {
        const auto any = static_cast<fault_kind>(chance.below(fault_kinds));
        kinds.insert(chance.one_in(2) || !can_act_on(of, any) ? chance.one_of(rich) : any);
    }
    if (chance.one_in(3)) kinds.insert(chance.one_of(ends));
    add_companions(kinds, chance);
    return kinds;
}

// One or two that hide nothing of what the box reads and writes, where most rules are exact.
fault_set clear_kinds(dice &chance, const machine &of) {
    std::vector<fault_kind> clear = {
        fault_kind::sensors, fault_kind::sensors, fault_kind::sensors,   fault_kind::reload,
        fault_kind::reload,  fault_kind::enable,  fault_kind::restart,   fault_kind::kill,
        fault_kind::disk,    fault_kind::state,   fault_kind::power_cut, fault_kind::twice};
    if (!of.nodes.empty()) clear.insert(clear.end(), 4, fault_kind::can);
    fault_set kinds = {chance.one_of(clear)};
    if (chance.one_in(3)) kinds.insert(chance.one_of(clear));
    add_companions(kinds, chance);
    return kinds;
}

// Throws std::invalid_argument for another name.
fault_kind kind_of(const std::string &name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
        throw std::invalid_argument("unknown fault '" + name + "'; see world --help");
    return static_cast<fault_kind>(found - names.begin());
}

// Calls that a signal may interrupt before they have done anything.
bool may_be_interrupted(const char *call) {
    static const std::set<std::string> all = {
        "read",  "write",           "recv",      "recvmsg",  "poll",
        "ppoll", "clock_nanosleep", "nanosleep", "sem_wait", "sigtimedwait"};
    return all.count(call) > 0;
}

}  // namespace

std::string name_of(fault_kind kind) {
    return names[static_cast<std::size_t>(kind)];
}

fault_set fault_set_of(const std::string &text) {
    fault_set kinds;
    if (text == "none") return kinds;
    if (text == "all") return every_kind();
    for (const auto &part : formats::split(text, ','))
        kinds.insert(kind_of(part.substr(0, part.find(':'))));
    return kinds;
}

fault_limits fault_limits_of(const std::string &text) {
    fault_limits most;
    for (const auto &part : formats::split(text, ',')) {
        const auto colon = part.find(':');
        if (colon == std::string::npos) continue;
        const fault_kind kind = kind_of(part.substr(0, colon));
        try {
            most[kind] = std::stoull(part.substr(colon + 1));
        } catch (const std::exception &) {
            throw std::invalid_argument("'" + part + "' needs a number behind ':'");
        }
    }
    return most;
}

std::string text_of(const fault_set &kinds, const fault_limits &most) {
    if (kinds.size() == fault_kinds && most.empty()) return "all";
    std::string text;
    for (const fault_kind kind : kinds) {
        text += (text.empty() ? "" : ",") + name_of(kind);
        const auto limit = most.find(kind);
        if (limit != most.end()) text += fmt::format(":{}", limit->second);
    }
    return text.empty() ? "none" : text;
}

fault_set swarm_of(std::uint64_t seed) {
    dice chance(seed, "swarm");
    const std::uint64_t drawn = chance.below(20);
    if (drawn < 2) return {};
    if (drawn < 10) return one_kind(chance, machine_of(seed));
    if (drawn < 14) return clear_kinds(chance, machine_of(seed));
    if (drawn < 18) return few_kinds(chance, machine_of(seed));
    if (drawn == 18) return every_kind();
    const double share = chance.log_between(0.04, 0.6);
    fault_set kinds;
    for (const fault_kind kind : every_kind()) {
        if (chance.chance(share)) kinds.insert(kind);
    }
    return kinds;
}

fault_injector::fault_injector(run &of, const fault_set &kinds, const fault_limits &most,
                               std::uint64_t seed)
    : of_(of),
      weak_calls_{{{dice(seed, "weak names").one_in(4),
                    12,
                    dice(seed, "names"),
                    {"rename", "unlink", "access", "ftruncate", "fsync"}},
                   {dice(seed, "weak folders").one_in(4),
                    40,
                    dice(seed, "folders"),
                    {"lstat", "opendir", "readdir"}},
                   {dice(seed, "weak threads").one_in(4),
                    3,
                    dice(seed, "beginning threads"),
                    {"pthread_create"}}}},
      bad_cable_(dice(seed, "bad cable").one_in(4)),
      own_(seed, "ends at a rename"),
      deaf_(seed, "systemd"),
      threads_(seed, "threads"),
      halves_(seed, "halves"),
      echoes_(seed, "echoes"),
      stops_(seed, "stops"),
      pauses_(seed, "pauses"),
      gaps_(seed, "gaps") {
    for (std::size_t k = 0; k < fault_kinds; ++k) {
        const auto kind = static_cast<fault_kind>(k);
        on_[k] = kinds.count(kind) > 0;
        chances_.emplace_back(seed, name_of(kind));
        rates_[k] = chances_[k].log_between(0.4, 5);
        const auto limit = most.find(kind);
        left_[k] = limit == most.end() ? ~std::uint64_t{0} : limit->second;
    }
}

void fault_injector::note(fault_kind kind, const std::string &words) {
    ++count_;
    if (last_.size() == remembered) last_.erase(last_.begin());
    const double now_s = static_cast<double>(of_.time.now()) * 1e-9;
    last_.push_back(fmt::format("{:.6f} s: {}: {}", now_s, name_of(kind), words));
    if (of_.options.prints_log) fmt::print("{:12.6f} [{}: {}]\n", now_s, name_of(kind), words);
}

bool fault_injector::due(countdown &of) {
    if (!has(of.kind)) return false;
    if (of.drawn && of.left-- > 0) return false;
    const bool first = !of.drawn;
    of.drawn = true;
    const double most = 2 * static_cast<double>(of.mean) / rates_[index(of.kind)];
    of.left = chance(of.kind).below(static_cast<std::uint64_t>(most) + 1);
    return !first && takes_one(of.kind);
}

bool fault_injector::takes_one(fault_kind kind) {
    std::uint64_t &left = left_[index(kind)];
    if (left == 0) return false;
    --left;
    return true;
}

void fault_injector::repeat(fault_kind kind, time_ns mean, const std::function<void()> &what) {
    if (!has(kind)) return;
    const auto most = static_cast<time_ns>(2 * static_cast<double>(mean) / rates_[index(kind)]);
    of_.time.at(of_.time.now() + chance(kind).time_between(0, most), [this, kind, mean, what] {
        if (has(kind) && takes_one(kind)) what();
        repeat(kind, mean, what);
    });
}

void fault_injector::later(time_ns pause, const std::function<void()> &what) {
    of_.time.at(of_.time.now() + pause, what);
}

void fault_injector::begin() {
    plan_operator();
    plan_wires();
    plan_plc();
    plan_foreign();
    plan_sensors();
    plan_ends();
    plan_stalls();
    plan_clock();
    plan_memory();
    plan_reader();
    plan_links();
    plan_files();
    plan_disk();
    plan_slowness();
    plan_muteness();
}

void fault_injector::end() {
    active_ = false;
    heal_plc();
    heal_computer();
    heal_files();
}

call_fate fault_injector::at_call(const call_site &site) {
    call_fate fate;
    if (!active_) return fate;
    die_if_due(lethal_calls_);
    if (dies_behind_rename_ && std::strcmp(site.name, "rename") == 0 &&
        std::strncmp(site.path, "/var/", 5) == 0)
        lethal_calls_ = static_cast<std::int64_t>(own_.below(4));
    if (due(slow_calls_)) {
        fate.delay_ns = static_cast<time_ns>(chance(fault_kind::delay).log_between(10e3, 200e6));
        note(fault_kind::delay,
             fmt::format("{} {} takes {} µs", site.name, site.path, fate.delay_ns / us));
    }
    fate.is_on_disk = is_on_disk(site);
    if (due(short_calls_)) {
        fate.half = true;
        // A daemon that cannot start needs its sentence.
        if (chance(fault_kind::partial).one_in(3) && may_be_interrupted(site.name) &&
            std::strcmp(site.path, "stderr") != 0)
            interrupt(site, fate);
    }
    if (of_.time.now() < renames_fail_until_ && std::strcmp(site.name, "rename") == 0)
        fate.error = EIO;
    refuse_call(site, fate);
    refuses_lines = refuses_lines || (fate.error != 0 && std::strcmp(site.path, "stderr") == 0);
    if (std::strcmp(site.name, "pthread_create") == 0 && refused_thread_-- == 0) {
        fate.error = threads_.one_in(2) ? EPERM : EAGAIN;
        of_.box.lacks_thread = true;
        note(fault_kind::restart, "a start gets no thread");
    }
    const bool is_message =
        std::strcmp(site.path, "systemd") == 0 && std::strcmp(site.name, "send") == 0;
    if (is_message && of_.time.now() < deaf_until_) fate.error = EAGAIN;
    if (is_message && fate.error != 0) of_.box.unheard_ns = of_.time.now();
    replace_what_is_read(site);
    return fate;
}

void fault_injector::interrupt(const call_site &site, call_fate &fate) {
    fate.error = EINTR;
    if (std::strcmp(site.name, "write") != 0) of_.box.interrupted_ns = of_.time.now();
}

preemption fault_injector::between_lines() {
    constexpr std::int64_t far = std::int64_t{1} << 20;
    const bool lethal = lethal_lines_ >= 0;
    if (active_ && lethal) die_if_due(lethal_lines_);
    if (!has(fault_kind::preempt)) return {0, lethal ? 1000 : far};
    dice &drawn = chance(fault_kind::preempt);
    ++count_;
    return {static_cast<time_ns>(drawn.log_between(1e3, 20e6)),
            static_cast<std::int64_t>(drawn.below(20000))};
}

// So long that the box has written more before the request acts (docs/decisions/0003).
time_ns fault_injector::draw_late() {
    const machine &facts = of_.running();
    return chance(fault_kind::delay)
        .time_between(2 * facts.period_us * us, facts.heartbeat_timeout_us * us);
}

// Now and then the next write while an output moves at most of its slew rate: the one that acts
// late is then far from those behind it.
bool fault_injector::is_late_write(std::size_t bytes) {
    constexpr std::size_t reading_bytes = 12;  // of TCP
    delays_write_ = delays_write_ || due(late_writes_);
    if (!delays_write_ || bytes <= reading_bytes) return false;
    const machine &facts = of_.box_machine;
    bool moves = false;
    sent_um_.resize(facts.channels.size());
    for (std::size_t c = 0; c < sent_um_.size(); ++c) {
        const double um = in_plc_um(facts.map.channels[c]);
        const double way_um = std::fabs(um - std::exchange(sent_um_[c], um));
        const double most_um =
            1e-6 * facts.channels[c].slew_um_per_s * static_cast<double>(facts.period_us);
        moves = moves || (way_um > 0.7 * most_um && way_um < 1.3 * most_um);
    }
    delays_write_ = !moves;
    return moves;
}

time_ns fault_injector::draw_delay() {
    dice &drawn = chance(fault_kind::delay);
    if (drawn.one_in(3)) return draw_late();
    return static_cast<time_ns>(drawn.log_between(100e3, 500e6));
}

// The first half comes shortly before the box waits no longer, a short rest behind that.
time_ns fault_injector::until_deadline() {
    const time_ns period_ns = of_.running().period_us * us;
    const time_ns left_ns = of_.ticked_ns() + 4 * period_ns / 5 - of_.time.now();
    return std::max<time_ns>(left_ns - halves_.time_between(0, 4 * ms), 0);
}

segment_fate fault_injector::at_segment(bool to_box, std::size_t bytes) {
    segment_fate fate;
    if (due(slow_segments_)) fate.delay_ns = draw_delay();
    if (!to_box && is_late_write(bytes)) fate.delay_ns = draw_late();
    if (bytes > 1 && due(torn_segments_)) {
        fate.cut_at = 1 + chance(fault_kind::tear).below(bytes - 1);
        fate.rest_ns = static_cast<time_ns>(chance(fault_kind::tear).log_between(10e3, 300e6));
        if (to_box && halves_.one_in(4)) fate.delay_ns = until_deadline();
    }
    if (due(stalls_)) {
        fate.lost = true;
        note(fault_kind::loss, "the connection stalls");
    }
    if (due(resets_)) {
        fate.reset = true;
        note(fault_kind::reset, "the connection is reset");
    }
    if (due(flips_)) {
        // Of the head and the function: numbers behind them have no check on this wire.
        fate.flips_bit =
            static_cast<int>(chance(fault_kind::wire).below(8 * std::min<std::size_t>(bytes, 8)));
        note(fault_kind::wire, fmt::format("bit {} of a frame flips", fate.flips_bit));
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

bool fault_injector::is_read_back(const fakeplc::byte_string &request) const {
    return request[0] == 3 && fakeplc::modbus::word(request, 1) == of_.box_machine.map.write.start;
}

// It does what it is asked to, without a reply that can be taken.
bool fault_injector::is_mute(const fakeplc::byte_string &request) const {
    if (request[0] != 3) return of_.time.now() < no_writes_until_;
    return is_read_back(request) && of_.time.now() < no_read_backs_until_;
}

// Other values in a right form would count, but not the echo of a write to other or fewer
// registers, nor a reading that contradicts its own number of bytes.
stray_reply fault_injector::draw_stray(const fakeplc::byte_string &request) {
    static const std::vector<stray_reply> of_any = {stray_reply::other_unit,
                                                    stray_reply::other_function,
                                                    stray_reply::shorter, stray_reply::longer};
    const stray_reply own = request[0] != 16    ? stray_reply::miscounted
                            : echoes_.one_in(2) ? stray_reply::fewer_registers
                                                : stray_reply::other_registers;
    dice &drawn = chance(fault_kind::stray);
    return drawn.one_in(5) ? own : drawn.one_of(of_any);
}

// Several writes without a reply while each of them may still take effect (docs/decisions/0003). By
// a bad cable it never ends: that alone shows whether a turn of late writes does.
bool fault_injector::is_lost_again(const fakeplc::byte_string &request) {
    if (due(series_of_losses_)) {
        const time_ns late_ns = longest_late(of_.running());
        loses_until_ = of_.time.now() + chance(fault_kind::loss).time_between(late_ns, 6 * late_ns);
        note(fault_kind::loss, "one write in four has no reply");
    }
    const bool loses = bad_cable_ ? has(fault_kind::loss) : of_.time.now() < loses_until_;
    return active_ && loses && request[0] != 3 && chance(fault_kind::loss).one_in(4);
}

reply_fate fault_injector::at_request(const fakeplc::byte_string &request) {
    reply_fate fate;
    fate.lost = due(lost_replies_) || is_mute(request) || is_lost_again(request);
    fate.ignored = active_ && of_.time.now() < silent_until_;
    fate.twice = due(twice_);
    const bool storms = active_ && of_.time.now() < resets_until_ && ++writes_ % 3 == 0;
    if (request[0] != 3 && storms) fate.resets = true;
    if (request[0] != 3 && due(lost_ends_)) {
        fate.resets = true;
        note(fault_kind::reset, "a write acts, and the connection is reset");
    }
    if (due(strays_)) fate.stray = draw_stray(request);
    if (fate.lost) fate.stray = stray_reply::none;
    if (is_mute(request) && garbles_ && !gaps_.one_in(6))
        fate.stray = chance(fault_kind::mute).one_in(2) ? stray_reply::other_unit
                                                        : stray_reply::other_function;
    if (active_ && of_.time.now() < gateway_until_ && request[0] != 3) {
        fate.stray = draw_stray(request);
        fate.ignored = true;
    }
    fate.torn = due(torn_readings_);
    if (due(exceptions_))
        fate.exception = static_cast<int>(1 + chance(fault_kind::exception).below(11));
    if (active_ && of_.time.now() < refuses_until_ && request[0] == refused_function_)
        fate.exception = refused_code_;
    if (active_ && of_.time.now() < hides_block_until_ && is_read_back(request)) fate.exception = 2;
    if (active_ && of_.time.now() < slow_until_) fate.delay_ns = slow_ns_;
    if (has(fault_kind::suspend) && is_read_back(request) && pauses_.one_in(8))
        pause_behind_read_back();
    return fate;
}

// While what the box has read waits for its use.
void fault_injector::pause_behind_read_back() {
    const time_ns period_ns = of_.running().period_us * us;
    const time_ns lasts = pauses_.time_between(3 * period_ns, 20 * period_ns);
    later(pauses_.time_between(0, 2 * period_ns), [this, lasts] {
        note(fault_kind::suspend, fmt::format("for {} ms, behind a read-back", lasts / ms));
        of_.box.suspend(lasts);
    });
}

}  // namespace compbox::world
