// SPDX-License-Identifier: MIT
#include "tests/world/run.h"

#include <fmt/core.h>
#include <linux/can.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdio>
#include <utility>

extern "C" {
#include "hal/linux/daemon/loop.h"
}

#include "tests/world/blocks.h"
#include "tests/world/devices.h"

namespace compbox::world {

namespace {

using fakeplc::modbus::word;

// The longest time that the daemon may take from SIGTERM to its end, beside the ramps of its file.
constexpr time_ns longest_stop = 120 * second;
constexpr time_ns longest_rest = 1000 * second;  // an operator does not wait longer for zero
constexpr double largest_before_um = 300.0;      // of any output of the machines that are drawn
constexpr time_ns restart_pause = 2 * second;
constexpr std::uint64_t most_recorded = 20000;  // cycles of a record, which must fit on the disk

// Some machines have one, mostly below the limits of the file.
std::optional<site_ceiling> ceiling_of(const machine &of, std::uint64_t seed) {
    dice chance(seed, "ceiling");
    if (!chance.one_in(6)) return std::nullopt;
    double largest_um = 0, slowest = 1e6;
    for (const auto &channel : of.channels) {
        largest_um = std::max(largest_um, channel.limit_um);
        slowest = std::min(slowest, channel.slew_um_per_s);
    }
    site_ceiling drawn{std::round(largest_um * chance.between(0.1, 1.2)) + 1,
                       std::round(slowest * chance.between(1, 5)) + 1};
    // A slope has to reach 0 within a second, so a rate may bound slopes too.
    const bool has_slopes = std::any_of(of.channels.begin(), of.channels.end(),
                                        [](const auto &one) { return one.slope_limit > 0; });
    if (has_slopes && chance.one_in(2))
        drawn.um_per_s = std::round(10 * chance.log_between(2, 30)) / 10;
    return drawn;
}

std::optional<file_signer> signer_of(std::uint64_t seed) {
    if (!dice(seed, "signer").one_in(3)) return std::nullopt;
    return file_signer(seed);
}

}  // namespace

run::run(const run_options &with)
    : options(with),
      box_machine(machine_of(with.seed)),
      box(time, with.seed),
      net(box, with.seed),
      plc(box_machine, net, with.seed),
      faults(*this, with.faults, with.most, with.seed),
      signer(signer_of(with.seed)),
      ceiling_(ceiling_of(box_machine, with.seed)),
      chance_(with.seed, "run"),
      requests_(with.seed, "requests") {
    files_suffer_ = draws_any(*this, {fault_kind::disk, fault_kind::clock, fault_kind::refuse,
                                      fault_kind::partial, fault_kind::links, fault_kind::power_cut,
                                      fault_kind::kill, fault_kind::restart, fault_kind::reader});
    if (ceiling_) lower_to(box_machine, *ceiling_);
    dice accepts(with.seed, "accepts");
    if (accepts.one_in(6)) net.accepts_after = accepts.time_between(20 * ms, 600 * ms);
    box.faults = &faults;
    net.faults = &faults;
    plc.faults = &faults;
    net.listen(box_machine.port, &plc);
    net.longest_wait = [this](time_ns sent) { return running_at(sent).heartbeat_timeout_us * us; };
    box.make_socket = [this](int domain, int) { return make_socket(domain); };
    connect_wires();
    fill_blackbox();
    fill_events();
    fill_records();
    fill_temporaries();
    if (keeps_blackbox() && requests_.one_in(2)) plan_request();
    invariants_ = all_invariants(*this);
    box.ended = [this](const ending &how) { daemon_ended(how); };
    box.ticked = [this] { count_tick(); };
    box.logged = [this](const std::string &line) {
        if (options.prints_log)
            fmt::print("{:12.6f} {}\n", static_cast<double>(time.now()) * 1e-9, line);
        each([&](invariant &one) { one.logged(line); });
        heed(line);
    };
    box.supervised = [this](const std::string &words) {
        each([&](invariant &one) { one.supervised(words); });
    };
    box.rename_failed = [this](const std::string &path) {
        each([&](invariant &one) { one.rename_failed(path); });
    };
    box.files.written = [this](const std::string &path, const node &file) {
        each([&](invariant &one) { one.file_written(path, file); });
        note_report(path, file.bytes);
    };
    plc.answered = [this](time_ns sent, const fakeplc::byte_string &request,
                          const fakeplc::byte_string &reply,
                          time_ns duration) { note_exchange(sent, request, reply, duration); };
    plc.asked = [this](bool first, bool settled) {
        each([&](invariant &one) {
            one.asked({false, first, settled, false, false, false, false, false});
        });
    };
    net.torn = [this](time_ns rest) { each([&](invariant &one) { one.reply_torn(rest); }); };
    plc.scanned = [this](const fakeplc::plc_state &state) {
        each([&](invariant &one) { one.scanned(state); });
    };
    box.files.make_folder(keys_path);
    if (signer) box.files.put(std::string(keys_path) + "/factory.pub", signer->known_key());
    good_file = first_file();
    put_signed(good_file);
    note_file(good_file);
    taken_ = combined_ = {{0, 1}};
}

// ---- coefficient files

// One that others follow may lack signals and terms that they have.
std::string run::first_file() const {
    dice own(options.seed, "first file");
    const bool is_another = draws(*this, fault_kind::reload) && own.one_in(3);
    return is_another ? another_file(box_machine, own, box_machine.revision) : box_machine.text;
}

// A file is asked for twice.
const std::optional<machine> &run::facts_in(const std::string &text) {
    if (newest_facts_.first != text) newest_facts_ = {text, facts_of(box_machine, text)};
    return newest_facts_.second;
}

void run::note_file(const std::string &text) {
    auto facts = facts_in(text);
    if (!facts) return;
    if (ceiling_) lower_to(*facts, *ceiling_);
    files_.insert_or_assign(facts->revision, *facts);
}

// Beside the signature of the file before, while both are being replaced (hal/linux/enrolled.h).
// Nobody signs a revision ahead of all others: behind it the box would take no other file.
void run::sign(const std::string &text) {
    if (!signer) return;
    const auto &facts = facts_in(text);
    if (facts && facts->revision > revision) return;
    dice own(options.seed + signatures_++, "signature");
    const bool is_beside = own.one_in(4);
    if (!is_beside) box.files.remove(new_signature_path);
    box.files.replace(is_beside ? new_signature_path : signature_path, signer->sign(text, own));
}

void run::put_signed(const std::string &text) {
    sign(text);
    box.files.replace(config_path, text);
}

unsigned run::next_revision() {
    do ++revision;
    while (files_.count(revision) > 0);
    return revision;
}

bool run::knows_revision_of(const std::string &text) {
    const auto &facts = facts_in(text);
    return facts && files_.count(facts->revision) > 0;
}

const machine *run::file_of(const std::string &text) {
    const auto &facts = facts_in(text);
    return facts ? with_revision(facts->revision) : nullptr;
}

const machine *run::with_revision(unsigned number) const {
    const auto found = files_.find(number);
    return found == files_.end() ? nullptr : &found->second;
}

std::string run::good_file_of(unsigned of_revision) {
    dice chance(options.seed + of_revision, "good file");
    good_file = another_file(box_machine, chance, of_revision);
    note_file(good_file);
    return good_file;
}

// The box's own revision says which of the files it runs; the loop counts its steps.
void run::follow_file() {
    const auto *loop = static_cast<const cb_loop *>(box.argument_of("compboxd-loop"));
    if (loop == nullptr) return;
    steps_of_daemon = loop->made;
    const unsigned now = loop->box->config.revision, before = taken_.back().revision;
    const bool first = std::exchange(runs_first_file_, true) == false;
    if (wrong_revisions.count(now) > 0 && options.faults.count(fault_kind::memory) == 0)
        report("wrong file",
               fmt::format("revision {} runs, and has a mistake or no signature", now));
    const bool again = std::exchange(generation_, loop->generation) != loop->generation;
    if ((now == before && !again) || files_.count(now) == 0) return;
    if (now != before) taken_.push_back({time.now(), now});
    if (first) return;
    each([&](invariant &one) { one.taken(files_.at(before), files_.at(now)); });
}

const machine &run::file_at(const std::vector<taken_file> &files, time_ns sent) const {
    auto at = files.rbegin();
    while (at + 1 != files.rend() && at->at > sent) ++at;
    return files_.at(at->revision);
}

const machine &run::running_at(time_ns sent) const {
    return file_at(taken_, sent);
}

const machine &run::author_of(const exchange &seen) const {
    return file_at(seen.function == 23 ? combined_ : taken_, seen.sent);
}

time_ns run::rest_ns(const machine &by) {
    return 5 * second + ramp_ns(by, largest_before_um) + static_cast<time_ns>(by.hold_us) * us;
}

time_ns run::rest_ns() {
    follow_file();
    const time_ns now = rest_ns(running());
    return std::max(rest_ns(box_machine), now > longest_rest ? 0 : now);
}

// To rest, then what a connection, a restart and the operator's reset may take.
time_ns run::recovery_ns() {
    return rest_ns() + 60 * second;
}

std::uint64_t run::quiet_cycles() {
    constexpr time_ns behind = 5 * second;  // in which the recovery is judged
    return static_cast<std::uint64_t>((recovery_ns() + behind) / (box_machine.period_us * us));
}

std::shared_ptr<open_file> run::make_socket(int domain) {
    if (domain == AF_INET || domain == AF_INET6) return make_tcp_socket(net);
    if (domain == AF_UNIX)
        return make_notify_socket(
            box, [this] { return can != nullptr && can->state() == can_bus::interface_state::up; });
    if (domain == AF_CAN && can != nullptr) return can->make_socket();
    return nullptr;
}

void run::connect_wires() {
    const std::uint64_t seed = options.seed;
    if (!box_machine.plc_device.empty()) {
        plc_line = std::make_unique<serial_line>(box, box_machine.plc_device, seed);
        plc_line->faults = &faults;
        plc_slave_ = std::make_unique<rtu_slaves>(
            *plc_line, time, [this](int unit, const fakeplc::byte_string &request, time_ns sent) {
                if (unit != 1) return rtu_slaves::reply{};
                const auto done = plc.serve(request, sent);
                return rtu_slaves::reply{
                    done.alone ? plc_side::stray_pdu(done.reply, done.stray) : done.reply,
                    done.duration / ms * ms, done.alone, done.stray == stray_reply::other_unit};
            });
        plc_line->asks = [this](const serial_line::question &before,
                                const fakeplc::byte_string &now, time_ns quiet) {
            const question asked{true,
                                 before.frame.empty(),
                                 before.settled,
                                 is_probe(before.frame) && !before.refused,
                                 is_probe(now),
                                 before.damaged && is_of_read_block(before.frame),
                                 now == before.frame,
                                 is_of_read_block(now)};
            each([&](invariant &one) {
                one.asked(asked);
                one.line_asked(quiet, plc_line->silence());
            });
        };
    }
    if (!box_machine.modules.empty()) {
        bus_line = std::make_unique<serial_line>(box, "/dev/ttyS1", seed);
        bus_line->faults = &faults;
        bus_line->asks = [this](const serial_line::question &before,
                                const fakeplc::byte_string &now, time_ns quiet) {
            each([&](invariant &one) {
                one.module_asked({now[0], word(now, 2)},
                                 {before.frame.empty(), before.prompt, before.heard});
                one.line_asked(quiet, bus_line->silence());
            });
        };
        for (const auto &module : box_machine.modules) modules_.add(module);
        bus_slaves_ = std::make_unique<rtu_slaves>(
            *bus_line, time, [this](int unit, const fakeplc::byte_string &request, time_ns) {
                return answer_module(unit, request);
            });
        wander_modules();
    }
    if (box_machine.is_measured) {
        measurer = std::make_unique<person>(time, box, seed);
        measurer->told = [this](double um, unsigned count) {
            each([&](invariant &one) { one.sampled("H", um); });
            each([&](invariant &one) { one.sampled("H_n", count); });
        };
    }
    if (box_machine.nodes.empty()) return;
    box.interface_index = [of = box_machine.file().at("can").value("interface", "can0")](
                              const std::string &name) { return name == of ? 3U : 0U; };
    can = std::make_unique<can_bus>(box, box_machine.nodes, seed);
    can->heard = [this](int node, double degC) {
        each([&](invariant &one) { one.sampled(fmt::format("C{}", node), degC); });
    };
}

// A person asks for a file of the black box now and then.
void run::plan_request() {
    time.at(time.now() + requests_.time_between(5 * second, 90 * second), [this] {
        if (box.runs() && cycles_of_daemon > 0) {
            requests_s.push_back(1e-9 * static_cast<double>(box.wall()));
            box.send_signal(10);  // SIGUSR1
        }
        plan_request();
    });
}

// A reading of fewer registers than any block has (docs/rtu.md).
bool run::is_probe(const fakeplc::byte_string &frame) const {
    constexpr int most = 3;
    if (frame.size() != 8 || frame[1] != 3) return false;
    const int count = word(frame, 4);
    const fakeplc::register_map &map = running().map;
    return count <= most && count != map.read.count && count != map.write.count;
}

// A look back, which comes where the exchange leaves room, is not repeated.
bool run::is_of_read_block(const fakeplc::byte_string &frame) const {
    return frame[1] == 3 && word(frame, 2) == running().map.read.start;
}

// out: the signals of a module in these registers, each with its place; a register without one
//      refuses a reading (docs/coefficient-file.md)
std::map<std::size_t, std::string> run::thermometers_in(int unit, std::size_t start,
                                                        std::size_t count) const {
    std::map<std::size_t, std::string> found;
    for (const auto &signal : box_machine.file().at("signals")) {
        if (!signal.contains("bus") || signal.at("unit_id") != unit) continue;
        const std::size_t at = signal.at("register");
        if (at >= start && at < start + count) found[at - start] = signal.at("name");
    }
    return found;
}

rtu_slaves::reply run::answer_module(int unit, const fakeplc::byte_string &request) {
    if (faults.module_is_silent(unit)) return {};
    auto reply = modules_.answer(unit, request);
    const std::size_t start = word(request, 1), count = word(request, 3);
    const auto thermometers = thermometers_in(unit, start, count);
    if (faults.module_refuses(unit))
        reply.pdu = fakeplc::modbus::exception_reply(request[0], 4);
    else if (thermometers.size() < count)
        reply.pdu = fakeplc::modbus::exception_reply(request[0], 2);
    else
        for (const auto &[place, signal] : thermometers) {
            const double degC = 0.1 * static_cast<std::int16_t>(word(reply.pdu, 2 + 2 * place));
            each([&, &name = signal](invariant &one) { one.sampled(name, degC); });
        }
    return {reply.pdu, reply.delay_ms * ms + box_machine.module_delay_ns};
}

// The temperatures of the modules on the bus.
void run::wander_modules() {
    for (std::size_t i = 0; i < box_machine.modules.size(); ++i) {
        const double degC = 20 + chance_.between(-1, 1);
        modules_.run(fmt::format("set {} 0 {:.1f}", first_module + i, degC));
        for (const auto &other : thermometers_in(first_module + static_cast<int>(i), 1, 2))
            modules_.run(
                fmt::format("set {} {} {:.1f}", first_module + i, 1 + other.first, degC + 1));
    }
    time.at(time.now() + second, [this] { wander_modules(); });
}

// A folder with almost as many files as the box keeps, and a file with a name that is not its own.
void run::fill_blackbox() {
    dice own(options.seed, "black box");
    if (!keeps_blackbox() || !own.one_in(2)) return;
    const std::uint64_t first = 1 + own.below(500), count = blackbox_files - own.below(4);
    for (std::uint64_t i = 0; i < count; ++i)
        box.files.put(fmt::format("{}/{:06}-20200101T000000Z-FAULT.csv", blackbox_path, first + i),
                      "unix_s,mode\n");
    box.files.put(fmt::format("{}/0001-20200101T000000Z-FAULT.csv", blackbox_path), "unix_s\n");
}

// Snapshot and statistics are parsed once for all invariants.
void run::note_report(const std::string &path, const std::string &text) {
    if (path != snapshot_path && path != stats_path) return;
    has_statistics = has_statistics || path == stats_path;
    const auto all = nlohmann::json::parse(text, nullptr, false);
    if (!all.is_object()) return;
    each([&](invariant &one) { path == stats_path ? one.reported(all) : one.shown(all); });
}

// A file of events that is almost as long as it may be.
void run::fill_events() {
    dice own(options.seed, "old events");
    if (!keeps_events() || !own.one_in(4)) return;
    const std::string line = "{\"kind\":\"log\",\"text\":\"" + std::string(1970, 'x') + "\"}\n";
    const std::size_t bytes = most_events_bytes - own.below(6000);
    std::string text;
    while (text.size() + line.size() <= bytes) text += line;
    box.files.put(events_path, text);
}

// Old records that almost reach their limit, or the one of a daemon that had no limit yet.
void run::fill_records() {
    if (!limits_records() || !keeps_record()) return;
    if (!dice(options.seed, "old records").one_in(2)) {
        std::string text = "time_s,mode,reason\n";
        for (int row = 0; text.size() < unlimited_record_bytes; ++row)
            text += fmt::format("{:.3f},ACTIVE,NONE\n", 0.03 * row);
        box.files.put(std::string(record_path) + ".1", text);
        return;
    }
    for (int n = 1; n <= old_records; ++n)
        box.files.put(fmt::format("{}.{}.gz", record_path, n), std::string(old_record_bytes, 'x'));
}

// What a crash leaves of files that were not whole yet.
void run::fill_temporaries() {
    dice own(options.seed, "temporaries");
    for (const std::string path : {state_path, stats_path, snapshot_path})
        if (own.one_in(4)) box.files.put(path + unfinished, "half of a fi");
}

bool run::keeps_record() const {
    return (options.seed % 4 == 0 || (files_suffer_ && options.seed % 2 == 1)) &&
           options.cycles <= most_recorded;
}

bool run::keeps_blackbox() const {
    return options.seed % 5 == 1 || (files_suffer_ && options.seed % 5 < 3);
}

// libc's streams, which write them, do not repeat what was interrupted.
bool run::keeps_inputs() const {
    return options.seed % 6 == 2 && options.cycles <= most_recorded &&
           !draws_any(*this, {fault_kind::partial, fault_kind::refuse});
}

bool run::keeps_snapshot() const {
    const bool has_more =
        !box_machine.map.probes.empty() || box_machine.text.find("\"sigma\"") != std::string::npos;
    return keeps_slow_snapshot() || options.seed % 7 == 0 || (has_more && options.seed % 2 == 0);
}

void run::start_daemon() {
    if (box.runs()) return;
    std::vector<std::string> words = {"compboxd", "--config", config_path, "--state",
                                      state_path, "--stats",  stats_path};
    if (keeps_record()) words.insert(words.end(), {"--record", record_path});
    if (!records_each_cycle()) words.insert(words.end(), {"--record-every", "500"});
    if (options.seed % 3 != 0)
        words.insert(words.end(), {"--state-every", options.seed % 3 == 1 ? "1" : "3"});
    if (keeps_blackbox()) words.insert(words.end(), {"--blackbox", blackbox_path});
    if (limits_records()) words.insert(words.end(), {"--record-most", "1"});
    if (keeps_inputs()) words.insert(words.end(), {"--record-inputs", inputs_path});
    if (keeps_snapshot()) words.insert(words.end(), {"--snapshot", snapshot_path});
    if (keeps_slow_snapshot()) words.insert(words.end(), {"--snapshot-every", "1000"});
    if (keeps_events()) words.insert(words.end(), {"--events", events_path});
    if (has_watchdog()) words.insert(words.end(), {"--watchdog", "/dev/watchdog"});
    if (ticks_by_boottime()) words.insert(words.end(), {"--clock", "boottime"});
    if (options.seed % 2 == 0)
        box.environment = {{"NOTIFY_SOCKET", "/run/systemd/notify"},
                           {"WATCHDOG_USEC", fmt::format("{}", systemd_waits / us)}};
    if (ceiling_)
        words.insert(words.end(), {"--most-um", fmt::format("{}", ceiling_->um), "--most-um-per-s",
                                   fmt::format("{}", ceiling_->um_per_s)});
    if (signer || options.seed % 2 == 0) words.insert(words.end(), {"--keys", keys_path});
    faults.starting();
    ++result_.starts;
    runs_first_file_ = false;
    steps_of_daemon = 0;
    longest_gap_ns = ticked_ns_ = 0;
    flipped_ns = never;
    flipped_at_step = ~std::uint64_t{0};
    cycles_of_daemon = 0;
    stop_asked = false;
    has_statistics = false;
    each([](invariant &one) { one.started(); });
    if (measurer) measurer->daemon_starts();
    box.start_daemon(words);
}

void run::restart_after(time_ns pause) {
    time.at(time.now() + pause, [this] {
        if (!asked_to_stop) start_daemon();
    });
}

void run::daemon_ended(const ending &how) {
    if (how.power_cut) box.files.remove(snapshot_path);  // in memory, as /run is
    each([&](invariant &one) { one.ended(how); });
    if (asked_to_stop) {
        time.stop();
        return;
    }
    const bool cut_behind = !how.power_cut && stop_asked && faults.cuts_power();
    if (cut_behind) {
        box.files.cut_power(chance_);
        box.files.remove(snapshot_path);
    }
    if (how.power_cut || cut_behind) {
        box.boot();
        faults.booted();
    }
    restart_after(restart_pause + faults.stays_off());
}

void run::stop_daemon() {
    stop_asked = true;
    faults.stopping();
    box.send_signal(15);
}

void run::count_tick() {
    if (stepping_ != combined_.back().revision) combined_.push_back({time.now(), stepping_});
    follow_file();
    stepping_ = taken_.back().revision;
    ++cycles_of_daemon;
    ++cycles;
    if (ticked_ns_ > 0) longest_gap_ns = std::max(longest_gap_ns, time.now() - ticked_ns_);
    ticked_ns_ = time.now();
    each([](invariant &one) { one.ticked(); });
    if (cycles == options.cycles) time.at(time.now(), [this] { end_faults(); });
    if (cycles == options.cycles + quiet_) time.at(time.now(), [this] { ask_to_stop(); });
}

// The quiet end of a run: the world is put right, and must recover.
void run::end_faults() {
    if (!faults.active()) return;
    // Nobody waits hours for a file to go to zero: the operator switches the box off and on.
    follow_file();
    if (rest_ns(running()) > longest_rest) box.kill();
    faults.end();
    if (quiet_ > 0) quiet_ = std::max(quiet_, quiet_cycles());
    each([](invariant &one) { one.faults_ended(); });
}

// The operator of a world that was put right restarts a service whose log refuses the good file: a
// fault may have left it with another PLC's address, or with a later revision.
void run::heed(const std::string &line) {
    const bool restarts = line.find("which takes a restart") != std::string::npos ||
                          line.find("is older than the running one") != std::string::npos;
    if (faults.active() || !restarts) return;
    time.at(time.now() + second, [this, start = starts()] {
        if (starts() == start && box.runs() && !stop_asked) stop_daemon();
    });
}

// The end of the run: no more faults, SIGTERM, and a time within which the daemon must be gone.
void run::ask_to_stop() {
    if (asked_to_stop) return;
    asked_to_stop = stop_asked = true;
    end_faults();
    time.at(time.now() + longest_stop + ramp_ns(running(), largest_before_um),
            [this] { time.stop(); });
    if (!box.runs()) {
        time.stop();
        return;
    }
    box.send_signal(15);
}

void run::report(const char *invariant, const std::string &words) {
    if (!result_.violations.empty()) return;
    result_.violations.push_back({invariant, words, time.now(), cycles, faults.last()});
    time.stop();
}

// in : PDUs
void run::note_exchange(time_ns sent, const fakeplc::byte_string &request,
                        const fakeplc::byte_string &reply, time_ns duration) {
    const int start = request.size() < 3 ? 0 : word(request, 1);
    exchange seen{time.now(), sent, duration, request[0], 0, {}, start, {}};
    if (reply[0] & 0x80) {
        seen.exception = reply[1];
    } else {
        const bool reads = seen.function == 3 || seen.function == 23;
        for (std::size_t i = 2; reads && i + 1 < reply.size(); i += 2)
            seen.read.push_back(word(reply, i));
        const std::size_t values_at = seen.function == 16 ? 6 : seen.function == 23 ? 10 : 0;
        for (std::size_t i = values_at; values_at > 0 && i + 1 < request.size(); i += 2)
            seen.written.push_back(word(request, i));
    }
    box.hash.add(reply.data(), reply.size());
    if (options.prints_exchanges) print_exchange(seen);
    each([&](invariant &one) { one.exchanged(seen); });
}

// The time of sending behind the present one; what was read and what was written.
void run::print_exchange(const exchange &seen) const {
    const machine &facts = running_at(seen.sent), &author = author_of(seen);
    std::string words;
    if (seen.exception != 0) words += fmt::format(", exception {}", seen.exception);
    if (seen.duration == never) words += ", no reply";
    if (is_reading(facts, seen)) {
        const read_head head = head_of(facts, seen);
        words += fmt::format(", control {:#x} heartbeat {}{}", head.control, head.heartbeat,
                             head.whole ? "" : " torn");
        for (const fakeplc::shown_signal &signal : facts.map.signals)
            words += fmt::format(" {} {:.6g}", signal.name, signal_in(facts, signal, seen));
    }
    for (std::size_t c = 0; c < facts.channels.size(); ++c) {
        if (!is_reading(facts, seen) || !facts.channels[c].has_applied) continue;
        words += fmt::format(" {} applies {:.6g} µm", facts.channels[c].name,
                             applied_in(facts, c, seen));
    }
    if (is_read_back(facts, seen)) words += ", read back";
    if (!seen.written.empty()) {
        const written_block block = block_of(author, seen);
        words +=
            fmt::format(", mode {} reason {} beat {}", block.mode, block.reason, block.heartbeat);
        for (std::size_t c = 0; c < block.um.size(); ++c)
            words += fmt::format(" {} {:.6g} µm", author.channels[c].name, block.um[c]);
    }
    fmt::print("{:12.6f} (sent {:.6f}) FC{}{}\n", 1e-9 * static_cast<double>(seen.now),
               1e-9 * static_cast<double>(seen.sent), seen.function, words);
}

run_result run::go() {
    box.boot();
    faults.booted();
    if (options.prepare) options.prepare(*this);
    start_daemon();
    faults.begin();
    const time_ns period_ns = box_machine.period_us * us;
    // A short run, as one that has been shrunk, is not judged for its recovery.
    if (!options.faults.empty() && options.cycles >= quiet_cycles()) quiet_ = quiet_cycles();
    time.at(30 * second + static_cast<time_ns>(3 * options.cycles / 2) * period_ns,
            [this] { end_faults(); });
    // However much of the time no daemon runs, the world ends.
    time.at(60 * second + static_cast<time_ns>(2 * (options.cycles + quiet_)) * period_ns,
            [this] { ask_to_stop(); });
    time.run();
    if (result_.violations.empty()) each([](invariant &one) { one.finished(); });
    result_.cycles = cycles;
    result_.hash = box.hash.value();
    result_.faults = faults.count();
    result_.duration = time.now();
    return result_;
}

}  // namespace compbox::world
