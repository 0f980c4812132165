// SPDX-License-Identifier: MIT
// One computer with compboxd, and what a test does to both: files, peers, signals, power, clocks,
// calls that fail. What happens between two commands becomes events, in the order of their times.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/world/computer.h"
#include "tests/world/network.h"
#include "tests/world/scheduler.h"
#include "tests/world/serial_line.h"
#include "tests/world/stage/can_interfaces.h"
#include "tests/world/stage/control.h"

namespace compbox::world {

// Calls that fail or hang until they are healed.
class call_failures : public call_faults {
  public:
    struct rule {
        std::string call, path;  // of libc; "" for any path, else a part of it
        int error = 0;           // errno; 0: the call lasts this long
        time_ns lasts_ns = 0;
        int times = -1;   // how often; -1: always
        int skipped = 0;  // so many such calls work before
    };
    std::vector<rule> rules;
    std::function<void(const call_site &)> met;  // a rule applied

    call_fate at_call(const call_site &site) override;
    preemption between_lines() override { return {0, std::numeric_limits<std::int64_t>::max()}; }
};

class stage {
  public:
    explicit stage(std::uint64_t seed);

    // in : a command. out: the answer, without a line end; {"error": …} for what is no command
    std::string obey(const std::string &line);

  private:
    using json = nlohmann::json;
    using command = void (stage::*)(const json &arguments, json &answer);
    static const std::map<std::string, command> commands;

    // ---- time and process
    void run(const json &arguments, json &answer);
    void start(const json &arguments, json &answer);
    void signal(const json &arguments, json &answer);
    void cut_power(const json &arguments, json &answer);
    void boot(const json &arguments, json &answer);
    void suspend(const json &arguments, json &answer);
    void clocks(const json &arguments, json &answer);
    void set_clock(const json &arguments, json &answer);
    void fail(const json &arguments, json &answer);
    void heal(const json &arguments, json &answer);
    void flip(const json &arguments, json &answer);
    void stall(const json &arguments, json &answer);
    void held(const json &arguments, json &answer);
    // ---- files
    void put(const json &arguments, json &answer);
    void get(const json &arguments, json &answer);
    void rename(const json &arguments, json &answer);
    void remove(const json &arguments, json &answer);
    void make(const json &arguments, json &answer);
    void disk(const json &arguments, json &answer);
    // ---- network
    void listen(const json &arguments, json &answer);
    void send(const json &arguments, json &answer);
    void hang_up(const json &arguments, json &answer);
    void set_can(const json &arguments, json &answer);
    void put_frame(const json &arguments, json &answer);
    void set_line(const json &arguments, json &answer);
    void send_line(const json &arguments, json &answer);
    // ---- fakeplc
    void start_control(const json &arguments, json &answer);
    void end_control(const json &arguments, json &answer);
    void command_control(const json &arguments, json &answer);
    void ask_control(const json &arguments, json &answer);

    // A server of the test.
    struct server : tcp_peer {
        server(stage &of_stage, std::uint16_t at) : of(of_stage), port(at) {}
        bool accepted(const connection_ptr &from) override;
        void received(const connection_ptr &from, const std::string &bytes, time_ns sent) override;
        void closed(const connection_ptr &from, bool reset) override;
        stage &of;
        const std::uint16_t port;
    };
    void happened(json event);

    scheduler time_;
    computer box_;
    network net_;
    can_interfaces can_;
    std::map<std::string, std::unique_ptr<serial_line>> lines_;  // by their devices
    std::unique_ptr<control> control_;
    call_failures failures_;
    std::map<std::uint16_t, server> servers_;
    std::map<int, connection_ptr> links_;
    int links_made_ = 0;
    std::vector<json> events_;
    std::string log_;           // since the last answer
    std::uint64_t alarms_ = 0;  // ends of `run` that were planned
};

}  // namespace compbox::world
