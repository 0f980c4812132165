// SPDX-License-Identifier: MIT
// fakeplc on the stage: the control, its PLC and the machine (host-tools/fakeplc) behind a TCP port
// or on a serial line, with the program's commands, faults and log.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "host-tools/fakeplc/console.h"
#include "host-tools/fakeplc/log.h"
#include "host-tools/fakeplc/plc.h"
#include "host-tools/fakeplc/setup.h"
#include "host-tools/fakeplc/wire_server.h"
#include "tests/world/network.h"
#include "tests/world/serial_line.h"

namespace compbox::world {

// The wire's part of a command such as "fault drop 3", and of a reply.
class stage_wire : public fakeplc::wire_server {
  public:
    explicit stage_wire(scheduler &time) : time_(time) {}
    handler answer;  // set before the first request

    // Nothing here polls.
    void append_poll_set(std::vector<pollfd> &) const override {}
    void process(const std::vector<pollfd> &, std::int64_t, const handler &) override {}
    std::int64_t next_due_us() const override { return INT64_MAX; }
    fakeplc::fault_plan &faults() override { return faults_; }

  protected:
    // out: the reply's PDU; *what: the fault that it meets
    fakeplc::byte_string reply_to(const fakeplc::byte_string &request,
                                  std::optional<fakeplc::fault> *what);
    scheduler &time_;
    fakeplc::fault_plan faults_;
};

class control {
  public:
    // in : port: where it listens; 0: on `line`. Files are those of the real system. Throws
    // input_error.
    control(network &net, const fakeplc::plc_options &options, const std::string &log_file,
            std::uint16_t port, serial_line *line);
    ~control();

    // A command of fakeplc's console. out: its answer
    std::string run(const std::string &command);
    // A request by another client than the box. out: the reply, both PDU
    fakeplc::byte_string ask(const fakeplc::byte_string &request);

  private:
    void catch_up();
    void plan();

    scheduler &time_;
    fakeplc::plc_setup setup_;
    std::optional<fakeplc::plc_log> log_;
    fakeplc::fake_plc plc_;
    std::unique_ptr<stage_wire> wire_;
    fakeplc::console console_;
    std::shared_ptr<bool> here_ = std::make_shared<bool>(true);
};

}  // namespace compbox::world
