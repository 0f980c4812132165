// SPDX-License-Identifier: MIT
#include "host-tools/fakeplc/console.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <sstream>
#include <vector>

#include "host-tools/fakeplc/typed_number.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"

namespace compbox::fakeplc {

namespace {

using words = std::vector<std::string>;

[[noreturn]] void refuse(const std::string &sentence) {
    throw input_error(sentence);
}

void expect(const words &line, std::size_t count, const char *usage) {
    if (line.size() != count) refuse(std::string("usage: ") + usage);
}

bool on_off(const words &line, std::size_t at, const char *usage) {
    expect(line, at + 1, usage);
    return whole(line[at], 0, 1) == 1;
}

// in : words of "move X=1 Y=2 Z=3 feed=1000", mm and mm/min
// Throws input_error with the usage.
twin::twin_step step_of(const words &line) {
    twin::twin_step step;
    for (std::size_t i = 1; i < line.size(); ++i) {
        const auto equals = line[i].find('=');
        const std::string key = line[i].substr(0, equals);
        if (equals == std::string::npos) refuse("usage: move X=1 Y=2 Z=3 feed=1000");
        const double value = number(line[i].substr(equals + 1));
        const int axis = key.size() == 1 ? twin::axis_index(key[0]) : -1;
        if (key == "feed")
            step.feed_mm_per_s = value / 60.0;
        else if (axis >= 0)
            step.target_mm[static_cast<std::size_t>(axis)] = value;
        else
            refuse(fmt::format("'{}' is neither an axis nor feed", key));
    }
    if (!step.target_mm[0] && !step.target_mm[1] && !step.target_mm[2]) {
        refuse("usage: move X=1 Y=2 Z=3 feed=1000");
    }
    return step;
}

struct fault_syntax {
    fault_kind kind;
    bool has_value;
    int low, high;
};

const std::map<std::string, fault_syntax> &fault_names() {
    static const std::map<std::string, fault_syntax> names = {
        {"late", {fault_kind::late, true, 1, 600000}},
        {"drop", {fault_kind::drop, false, 0, 0}},
        {"exception", {fault_kind::exception, true, 1, 255}},
        {"wrong-id", {fault_kind::wrong_id, false, 0, 0}},
        {"truncate", {fault_kind::truncate, false, 0, 0}},
        {"dribble", {fault_kind::dribble, true, 1, 60000}},
        {"torn", {fault_kind::torn, false, 0, 0}},
        {"short", {fault_kind::too_short, false, 0, 0}},
        {"long", {fault_kind::too_long, false, 0, 0}},
        {"crc", {fault_kind::crc, false, 0, 0}},
        {"noise", {fault_kind::noise, true, 1, 200}},
    };
    return names;
}

// fault KIND [VALUE] [COUNT] [read|write]
std::string order_fault(words line, wire_server &server) {
    if (line.size() == 2 && line[1] == "clear") {
        server.faults().clear();
        return "ok";
    }
    if (line.size() == 2 && line[1] == "close") {
        const std::size_t count = server.clients();
        server.close_all_clients();
        return fmt::format("ok closed {}", count);
    }
    if (line.size() == 3 && line[1] == "away") {
        const std::size_t count = server.clients();
        server.go_away(whole(line[2], 1, 600000));
        return fmt::format("ok closed {}", count);
    }
    const auto found = line.size() < 2 ? fault_names().end() : fault_names().find(line[1]);
    if (found == fault_names().end()) {
        refuse(
            "usage: fault late|drop|exception|wrong-id|truncate|dribble|torn|short|long|crc|noise|"
            "close|away|clear …");
    }
    fault what;
    what.kind = found->second.kind;
    if (line.back() == "read") what.on_writes = false;
    if (line.back() == "write") what.on_reads = false;
    if (!what.on_reads || !what.on_writes) line.pop_back();
    std::size_t next = 2;
    if (found->second.has_value) {
        if (line.size() <= next) refuse(fmt::format("fault {} needs a number", line[1]));
        what.value = whole(line[next++], found->second.low, found->second.high);
    }
    const int count = line.size() > next ? whole(line[next++], 1, 1000000000) : 1;
    expect(line, next, "fault KIND [VALUE] [COUNT] [read|write]");
    server.faults().add(what, count);
    return "ok";
}

std::string listed(const twin::xyz &values) {
    std::string text;
    for (std::size_t a = 0; a < 3; ++a) {
        text +=
            fmt::format(" {}={}", twin::axis_letters[a], std::round(values[a] * 1e4) / 1e4 + 0.0);
    }
    return text;
}

std::string status_line(const fake_plc &plc, const wire_server &server) {
    const plc_state &state = plc.state();
    std::string text = fmt::format(
        "ok time_s={} control={} mode={} reason={} plc_heartbeat={} box_heartbeat={} alive={} "
        "moving={} clients={} alarms={} handshake={} limited={} probes={}",
        state.time_s, state.control, state.status & 0xFF, state.status >> 8, state.plc_heartbeat,
        state.box_heartbeat, state.box_alive ? "1" : "0", plc.moving() ? "1" : "0",
        server.clients(), plc.alarms().standing().size(), state.handshake,
        plc.duties().times_limited(), plc.probes().measurements());
    for (std::size_t c = 0; c < plc.map().channels.size(); ++c) {
        const std::string &name = plc.map().channels[c].name;
        text += fmt::format(" commanded_{}={}", name, state.commanded_um[c]);
        text += fmt::format(" applied_{}={}", name, state.applied_um[c]);
    }
    return text;
}

// ok COUNT NAME since_s=T "TEXT"; NAME …
std::string alarm_line(const fake_plc &plc) {
    std::string text = fmt::format("ok {}", plc.alarms().standing().size());
    for (const auto &one : plc.alarms().standing()) {
        text += fmt::format(" {} since_s={} \"{}\"{}", one.name, one.since_s, one.text,
                            one.needs_reset ? " until reset;" : ";");
    }
    return text;
}

std::string lower(std::string text) {
    for (char &c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

// A command as one cell of the log.
std::string for_log(const words &line) {
    std::string text;
    for (const auto &word : line) text += (text.empty() ? "" : " ") + word;
    std::replace(text.begin(), text.end(), ',', ';');
    return text;
}

// in : a command with its arguments, at least one word
// out: the answer, "ok" for a command without data; throws input_error for wrong usage
std::string run_words(const words &line, console &self) {
    fake_plc &plc = self.plc;
    const std::string &command = line[0];
    if (command == "enable")
        plc.set_enable(on_off(line, 1, "enable 0|1"));
    else if (command == "reference")
        plc.set_referenced(on_off(line, 1, "reference 0|1"));
    else if (command == "permit")
        plc.set_permit(on_off(line, 1, "permit 0|1"));
    else if (command == "reset")
        plc.press_reset();
    else if (command == "restart") {
        plc.restart();
        self.server.close_all_clients();
    } else if (command == "alarms")
        return alarm_line(plc);
    else if (command == "move")
        plc.move(step_of(line));
    else if (command == "position")
        return "ok" + listed(plc.state().position_mm);
    else if (command == "error") {
        return fmt::format("ok before{} after{}", listed(plc.state().error_before_um),
                           listed(plc.state().error_after_um));
    } else if (command == "status")
        return status_line(plc, self.server);
    else if (command == "freeze") {
        if (line.size() != 3 || line[1] != "heartbeat") refuse("usage: freeze heartbeat 0|1");
        plc.freeze_nc(on_off(line, 2, "freeze heartbeat 0|1"));
    } else if (command == "signal") {
        expect(line, 3, "signal NAME VALUE|auto");
        const bool known = line[2] == "auto" ? plc.release_signal(line[1])
                                             : plc.force_signal(line[1], number(line[2]));
        if (!known) refuse(fmt::format("no signal '{}' is shown or forced", line[1]));
    } else if (command == "probe") {
        if (line.size() != 2) expect(line, 3, "probe AXIS [OFF_UM]");
        if (!plc.probe(line[1], line.size() == 3 ? number(line[2]) : 0.0))
            refuse(fmt::format("no probe measures '{}': the map has no probe_{} with probe_{}_n",
                               line[1], lower(line[1]), lower(line[1])));
    } else if (command == "fault")
        return order_fault(line, self.server);
    else if (command == "quit")
        self.quit = true;
    else
        refuse(fmt::format("'{}' is not a command; see fakeplc --help", command));
    return "ok";
}

}  // namespace

std::string console::run(const std::string &line) {
    std::istringstream stream(line);
    words parts;
    for (std::string part; stream >> part;) parts.push_back(part);
    if (parts.empty()) return "error: an empty line";
    try {
        const std::string answer = run_words(parts, *this);
        if (answer == "ok" || parts[0] == "fault") plc.note("command " + for_log(parts));
        return answer;
    } catch (const input_error &error) {
        return std::string("error: ") + error.what();
    }
}

std::string_view console_help() {
    return "Commands on stdin, one a line, each answered by one line that begins with ok or "
           "error:\n"
           "  enable 0|1, reference 0|1, permit 0|1   the control bits; reset presses its bit for "
           "0.5 s\n"
           "  move X=.. Y=.. Z=.. feed=..             mm and mm/min along the path; queued\n"
           "  position, status, error                 prints positions, state, true errors of the "
           "machine\n"
           "  signal NAME VALUE|auto                  replaces the measured value; auto: ends "
           "that\n"
           "  probe AXIS [OFF_UM]                     a touch-probe cycle at standstill, wrong by "
           "OFF_UM\n"
           "  alarms                                  prints the active alarms\n"
           "  restart                                 switches the PLC's power off and on\n"
           "  freeze heartbeat 0|1                    NC coupling lost: positions and heartbeat "
           "freeze\n"
           "  fault late MS | dribble MS | exception CODE | drop | wrong-id | truncate | torn |\n"
           "        short | long   [COUNT] [read|write]   of the next replies;\n"
           "  fault close | away MS | clear           cuts connections; refuses new ones too; "
           "removes pending faults\n"
           "  quit\n";
}

}  // namespace compbox::fakeplc
