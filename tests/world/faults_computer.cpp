// SPDX-License-Identifier: MIT
// Faults of the box's computer: calls that fail, ends of the process, power, clocks, threads,
// memory.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>

#include "tests/world/faults.h"
#include "tests/world/run.h"

extern "C" {
#include "hal/linux/daemon/loop.h"
}

namespace compbox::world {

namespace {

constexpr time_ns year = 31557600 * second;

// The errors that each call may give on Linux, by its manual page, where the daemon can meet them.
const std::vector<int> &errors_of(const char *call) {
    static const std::map<std::string, std::vector<int>> all = {
        {"open", {EACCES, EMFILE, ENFILE, ENOMEM, EINTR, EIO, ENOSPC, EROFS}},
        {"close", {EINTR, EIO}},
        {"read", {EINTR, EIO, EAGAIN}},
        {"write", {EINTR, EAGAIN, ENOSPC, EIO, EPIPE, EFBIG, EDQUOT}},
        {"stat", {EACCES, EIO, ENOMEM}},
        {"lstat", {EACCES, EIO, ENOMEM}},
        {"fstat", {EIO, ENOMEM}},
        {"fsync", {EIO, ENOSPC, EROFS, EINTR}},
        {"ftruncate", {EIO, EFBIG, EINTR, EPERM}},
        {"rename", {EACCES, EIO, ENOSPC, EROFS, EBUSY}},
        {"unlink", {EACCES, EIO, EROFS, EBUSY}},
        {"access", {EACCES, EIO}},
        {"flock", {EWOULDBLOCK, EINTR, ENOLCK}},
        {"ioctl", {EINTR, EIO, ENOTTY, ENODEV}},
        {"fdopen", {ENOMEM}},
        {"opendir", {EACCES, EMFILE, ENFILE, ENOMEM, EIO}},
        {"readdir", {EIO}},
        {"poll", {EINTR, ENOMEM}},
        {"ppoll", {EINTR, ENOMEM}},
        {"socket", {EMFILE, ENFILE, ENOBUFS, ENOMEM, EACCES}},
        {"bind", {ENODEV, EADDRNOTAVAIL}},
        {"connect",
         {ENETUNREACH, EHOSTUNREACH, ETIMEDOUT, ECONNREFUSED, EADDRNOTAVAIL, EAGAIN, EINTR}},
        {"recv", {EAGAIN, EINTR, ECONNRESET, ENOMEM, ETIMEDOUT, EHOSTUNREACH}},
        {"recvmsg", {EAGAIN, EINTR, ENETDOWN, ENOBUFS}},
        {"send", {EAGAIN, EINTR, EPIPE, ECONNRESET, ENOBUFS, ENETUNREACH, ENOMEM}},
        {"shutdown", {ENOTCONN, ENOBUFS}},
        {"setsockopt", {ENOPROTOOPT, EINVAL, ENOBUFS}},
        {"getsockopt", {ENOBUFS, ENOPROTOOPT}},
        {"getaddrinfo", {ENOMEM}},
        {"if_nametoindex", {ENODEV}},
        {"calloc", {ENOMEM}},
        {"pthread_attr_init", {ENOMEM}},
        {"pthread_create", {EAGAIN, EPERM}},
        {"sigtimedwait", {EINTR, EAGAIN}},
        {"nanosleep", {EINTR}},
        {"clock_nanosleep", {EINTR}},
        {"sem_wait", {EINTR}},
        {"mlockall", {EPERM, ENOMEM, EAGAIN}},
        {"adjtimex", {EPERM}},
        {"tcgetattr", {EIO, EINTR}},
        {"tcsetattr", {EIO, EINTR}},
        {"tcflush", {EIO}},
    };
    static const std::vector<int> none;
    const auto found = all.find(call);
    return found == all.end() ? none : found->second;
}

}  // namespace

// Calls that change a name or a length are seldom, and so are those that ask for them or begin a
// thread: of one seed in four each of them may fail, and those of keys, which are fewer, more
// often. out: the dice for it; null: it does not
dice *fault_injector::weak(const call_site &site) {
    const bool is_of_keys = std::string_view(site.path).rfind(run::keys_path, 0) == 0;
    for (weak_calls &of : weak_calls_)
        if (of.are_weak && has(fault_kind::refuse) && of_.cycles_of_daemon > 0 &&
            std::count(of.names.begin(), of.names.end(), site.name) > 0 &&
            of.chance.one_in(is_of_keys ? 6 : of.many) && takes_one(fault_kind::refuse))
            return &of.chance;
    return nullptr;
}

// One call in some thousands, or for a while each call of one name.
void fault_injector::refuse_call(const call_site &site, call_fate &fate) {
    if (of_.time.now() < storm_until_ && stormy_call_ == site.name && of_.cycles_of_daemon > 0) {
        fate.error = stormy_error_;
        if (fate.error == EINTR) interrupt(site, fate);
        return;
    }
    const bool is_due = due(refused_calls_);
    dice *const of_weak = weak(site);
    if (!is_due && of_weak == nullptr) return;
    const std::vector<int> &errors = errors_of(site.name);
    // A daemon that cannot start needs its sentence.
    const bool explains = of_.cycles_of_daemon == 0 && std::strcmp(site.path, "stderr") == 0;
    if (errors.empty() || explains) return;
    dice &drawn = is_due ? chance(fault_kind::refuse) : *of_weak;
    fate.error = drawn.one_of(errors);
    note(fault_kind::refuse,
         fmt::format("{} {}: {}", site.name, site.path, std::strerror(fate.error)));
    if (fate.error == EINTR) interrupt(site, fate);
    if (!is_due || !drawn.one_in(10)) return;
    stormy_call_ = site.name;
    stormy_error_ = fate.error;
    storm_until_ = of_.time.now() + static_cast<time_ns>(drawn.log_between(10e6, 10e9));
    note(fault_kind::refuse,
         fmt::format("… and each {} for {} ms", site.name, (storm_until_ - of_.time.now()) / ms));
}

// ---- ends

void fault_injector::die() {
    lethal_calls_ = lethal_lines_ = -1;
    dies_behind_rename_ = false;
    of_.box.lines_left = 0;
    if (lethal_power_)
        of_.box.cut_power();
    else
        of_.box.kill();
}

void fault_injector::die_if_due(std::int64_t &left) {
    if (left < 0 || left-- > 0) return;
    die();
}

// Whoever must restart the box may also have switched permit resume off.
void fault_injector::withdraw_permission(dice &drawn) {
    fakeplc::fake_plc &control = of_.plc.control;
    of_.plc.catch_up();
    control.set_permit(false);
    if (of_.plc.permits_resume)
        later(drawn.time_between(3 * second, 40 * second),
              [&control] { control.set_permit(true); });
}

// A kill or a power cut comes at a moment, at a call, or between two lines.
void fault_injector::plan_ends() {
    const auto plan = [this](fault_kind kind, time_ns mean, bool by_power) {
        repeat(kind, mean, [this, kind, by_power] {
            if (!of_.box.runs()) return;
            dice &drawn = chance(kind);
            lethal_power_ = by_power;
            if (drawn.one_in(3)) withdraw_permission(drawn);
            const std::uint64_t way = drawn.below(3);
            if (way == 0) {
                note(kind, "now");
                die();
            } else if (way == 1 && own_.one_in(2)) {
                dies_behind_rename_ = true;
                note(kind, "when a file on the disk has its name");
            } else if (way == 1) {
                lethal_calls_ = static_cast<std::int64_t>(drawn.below(500));
                note(kind, fmt::format("in {} calls", lethal_calls_));
            } else {
                lethal_lines_ = static_cast<std::int64_t>(drawn.below(5));
                of_.box.lines_left = static_cast<std::int64_t>(drawn.below(5000));
                note(kind, fmt::format("in {} lines", of_.box.lines_left));
            }
        });
    };
    plan(fault_kind::kill, 20 * second, false);
    plan(fault_kind::power_cut, 30 * second, true);
    repeat(fault_kind::restart, 30 * second, [this] {
        if (!of_.box.runs()) return;
        dice own(of_.options.seed + static_cast<std::uint64_t>(of_.time.now()), "file at the end");
        if (!has(fault_kind::reload) || own.one_in(2)) return end_daemon();
        put_another_file();
        of_.box.send_signal(1);
        later(own.time_between(0, 200 * ms), [this] { end_daemon(); });
    });
}

void fault_injector::end_daemon() {
    if (!of_.box.runs()) return;
    note(fault_kind::restart, "SIGTERM");
    of_.stop_daemon();
}

bool fault_injector::cuts_power() {
    if (!has(fault_kind::power_cut) || !chance(fault_kind::power_cut).one_in(3)) return false;
    note(fault_kind::power_cut, "behind the daemon's end");
    return true;
}

// For longer than half of the PLC's heartbeat may last: one that counts each ms of the pause shows
// any value behind it.
time_ns fault_injector::stays_off() {
    dice own(of_.options.seed + of_.starts(), "stays off");
    if (!active_ || has(fault_kind::clock) || !own.one_in(6)) return 0;
    const time_ns pause = own.time_between(31 * second, 45 * second);
    later(pause, [this, counted = own.next()] {
        of_.plc.heartbeat_offset = static_cast<std::uint16_t>(of_.plc.heartbeat_offset + counted);
    });
    return pause;
}

void fault_injector::booted() {
    if (has(fault_kind::boundary)) {
        // Counters of µs and ms of 31 and 32 bits, and of ns and µs in a double.
        static const double ages_s[] = {2147.483648, 4294.967296, 2147483.648,
                                        4294967.296, 9007199.25,  3.2e9};
        dice &drawn = chance(fault_kind::boundary);
        const double age_s = ages_s[drawn.below(std::size(ages_s))] - drawn.between(0, 60);
        of_.box.grow_old(static_cast<time_ns>(age_s * 1e9));
        note(fault_kind::boundary, fmt::format("the computer is up for {:.0f} s", age_s));
    }
    if (!has(fault_kind::clock)) return;
    dice &drawn = chance(fault_kind::clock);
    if (drawn.one_in(3)) return;
    // Without a battery the clock starts anywhere, until the network comes.
    const time_ns error = drawn.time_between(-40 * year, 2 * year);
    note(fault_kind::clock, fmt::format("the wall clock starts {} s wrong", error / second));
    of_.box.set_wall_clock(error);
    of_.box.synchronised = false;
    later(drawn.time_between(5 * second, 60 * second), [this, error] {
        of_.box.set_wall_clock(-error);
        of_.box.synchronised = true;
    });
}

// ---- clocks and threads

// The clock is set while no daemon runs.
void fault_injector::jump_before_start() {
    dice own(of_.options.seed + of_.starts(), "clock before a start");
    if (!has(fault_kind::clock) || !own.one_in(2)) return;
    const auto size = static_cast<time_ns>(own.log_between(1e9, 1e12));
    const time_ns step = own.one_in(2) ? size : -size;
    note(fault_kind::clock, fmt::format("the wall clock jumps by {} ms", step / ms));
    of_.box.set_wall_clock(step);
}

void fault_injector::plan_clock() {
    repeat(fault_kind::clock, 15 * second, [this] {
        dice &drawn = chance(fault_kind::clock);
        if (drawn.one_in(4)) {
            of_.box.synchronised = !of_.box.synchronised;
            note(fault_kind::clock, of_.box.synchronised ? "synchronised" : "not synchronised");
            return;
        }
        const auto size = static_cast<time_ns>(drawn.log_between(1e6, 1e18));
        const time_ns step = drawn.one_in(2) ? size : -size;
        note(fault_kind::clock, fmt::format("the wall clock jumps by {} ms", step / ms));
        of_.box.set_wall_clock(step);
        if (drawn.one_in(2))
            later(drawn.time_between(0, 30 * second),
                  [this, step] { of_.box.set_wall_clock(-step); });
    });
    repeat(fault_kind::suspend, 20 * second, [this] {
        const auto pause =
            static_cast<time_ns>(chance(fault_kind::suspend).log_between(10e6, 100e9));
        note(fault_kind::suspend, fmt::format("for {} ms", pause / ms));
        of_.box.suspend(pause);
        // Together with the PLC, so the world's time needs not pass; beyond 31 bits of µs.
        if (dice(static_cast<std::uint64_t>(pause), "long suspend").one_in(10))
            of_.box.skip(2200 * second);
    });
}

void fault_injector::plan_stalls() {
    repeat(fault_kind::stall, 5 * second, [this] {
        const auto &all = of_.time.threads();
        if (all.empty()) return;
        dice &drawn = chance(fault_kind::stall);
        if (drawn.one_in(10)) {
            stall_again_and_again(drawn);
            return;
        }
        thread &one = *all[drawn.below(all.size())];
        const auto pause = static_cast<time_ns>(drawn.log_between(1e6, 10e9));
        note(fault_kind::stall, fmt::format("{} for {} ms", one.name, pause / ms));
        of_.time.hold(one, of_.time.now() + pause);
    });
}

// A computer that is too slow for a while: cycle after cycle of the loop comes late. Now and then a
// few more do, behind a fault that was reset.
void fault_injector::stall_again_and_again(dice &drawn) {
    const std::int64_t times = drawn.time_between(5, 24);
    hold_loop(times);
    dice own(static_cast<std::uint64_t>(of_.time.now()), "few stalls");
    const time_ns pause = own.time_between(2 * second, 9 * second);
    if (own.one_in(2)) later(pause, [this, few = own.time_between(1, 8)] { hold_loop(few); });
}

void fault_injector::hold_loop(std::int64_t times) {
    const time_ns period_ns = of_.running().period_us * us;
    note(fault_kind::stall, fmt::format("the loop, {} times in a row", times));
    for (std::int64_t i = 0; i < times; ++i)
        later(i * 5 * period_ns, [this, until_ns = (i * 5 + 3) * period_ns + of_.time.now()] {
            for (const auto &one : of_.time.threads())
                if (active_ && one->name == "compboxd-loop") of_.time.hold(*one, until_ns);
        });
}

void fault_injector::plan_reader() {
    repeat(fault_kind::reader, 20 * second, [this] {
        const auto lasts =
            static_cast<time_ns>(chance(fault_kind::reader).log_between(100e6, 60e9));
        note(fault_kind::reader, fmt::format("for {} ms", lasts / ms));
        of_.box.read_log(false);
        later(lasts, [this] { of_.box.read_log(true); });
        if (!deaf_.one_in(2)) return;
        const auto deaf_ns = static_cast<time_ns>(deaf_.log_between(20e6, 8e9));
        deaf_until_ = of_.time.now() + deaf_ns;
        note(fault_kind::reader, fmt::format("systemd's queue is full for {} ms", deaf_ns / ms));
    });
}

// ---- memory

// The box must stop all writing; the operator sees it and restarts the service.
void fault_injector::plan_memory() {
    repeat(fault_kind::memory, 15 * second, [this] {
        auto *const loop = static_cast<cb_loop *>(of_.box.argument_of("compboxd-loop"));
        if (loop == nullptr) return;
        dice &drawn = chance(fault_kind::memory);
        cb_config &config = loop->box->config;
        auto *const bytes = reinterpret_cast<unsigned char *>(&config);
        std::size_t at = drawn.below(sizeof config);
        // In one run of two nobody restarts the box before it has checked all of it twice.
        const bool waits = dice(of_.options.seed, "slow check").one_in(2);
        const bool in_use = drawn.one_in(2) && config.channels_count > 0 && !waits;
        if (in_use) {
            const cb_channel_config &one = config.channels[drawn.below(config.channels_count)];
            const auto *const limit = reinterpret_cast<const unsigned char *>(&one.limit_um);
            at = static_cast<std::size_t>(limit - bytes) + drawn.below(sizeof one.limit_um);
            dice own(of_.options.seed + static_cast<std::uint64_t>(of_.time.now()), "links");
            if (config.links_count > 0 && own.one_in(3))  // or which signal a term takes
                at = static_cast<std::size_t>(config.links - bytes) + own.below(config.links_count);
        }
        of_.flipped_at_step = std::min(of_.flipped_at_step, of_.steps_of_daemon);
        if (in_use) of_.flipped_ns = std::min(of_.flipped_ns, of_.time.now());
        bytes[at] = static_cast<unsigned char>(bytes[at] ^ (1u << drawn.below(8)));
        note(fault_kind::memory, fmt::format("a bit of byte {} of the configuration", at));
        constexpr int passes = 1700;  // steps of the box
        const time_ns stays = waits ? passes * of_.box_machine.period_us * us
                                    : drawn.time_between(2 * second, 40 * second);
        later(stays, [this, start = of_.starts()] {
            if (of_.starts() == start && of_.box.runs()) of_.stop_daemon();
        });
    });
}

void fault_injector::heal_computer() {
    lethal_calls_ = lethal_lines_ = -1;
    dies_behind_rename_ = false;
    storm_until_ = 0;
    of_.box.synchronised = true;
    for (const auto &one : of_.time.threads()) of_.time.release(*one);
    of_.box.end_suspend();
    of_.box.read_log(true);
    // A configuration that has changed in memory takes a restart.
    if (on_[index(fault_kind::memory)] && of_.box.runs()) of_.stop_daemon();
}

}  // namespace compbox::world
